// How far a pixel's projected splats are seen: of those that follow one another in a scene, until
// one would leave less than LEAST_SEEN of the light from behind.

struct seen_until {
    float through; // of those before; below 0 where there is an end
    float z;       // of the first that is not seen, and which of those at this depth it is
    int index;
};
layout(std430, binding = SEEN_UNTIL) restrict buffer SeenUntil { seen_until ends[]; };

bool is_seen(int i, ivec2 pixel) {
    int p = pixel.y * picture.x + pixel.x;
    float z = splats[i].z, end = ends[p].z;
    return z < end || (z == end && splats[i].index < ends[p].index);
}
