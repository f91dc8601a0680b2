// Points of the unit circle, as cosine and sine.

// The next power: a turned by b.
vec2 turned(vec2 a, vec2 b) { return vec2(a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x); }
