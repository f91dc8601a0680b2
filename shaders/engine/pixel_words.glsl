// The first of the WORDS that a pixel has of an array.
uint first_word(uvec2 pixel, uvec2 size) { return (pixel.y * size.x + pixel.x) * uint(WORDS); }
