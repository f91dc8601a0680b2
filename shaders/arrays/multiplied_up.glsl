// Over triangles, of what no pass over pixels knows the total of: what fragments let through is
// multiplied up in a target beside that of colours.
#if PASS == DRAW_SHADES
#define SHADES_SECOND
number second_of(surface s) { return s.alpha; }
#elif PASS == RESOLVE
#define RESOLVES_DRAWN
contribution resolved_drawn(uint p, vec4 held, vec4 second) {
    set_total(p, double(second.x));
    precise contribution c;
    for (int k = 0; k < 3; ++k) c.color[k] = double(held[k]);
    c.covers = double(held.a);
    return c;
}
#endif
