// A pixel's fragments from front to back, those at one depth in order of arrival:
// in `indices`, from
// offsets[p] on, once the pass RANK has run.

#if PASS == RANK
void own_pass(uint p, surface s) {
    uint rank = offsets[p];
    uint end = offsets[p + 1u];
    for (uint i = offsets[p]; i < end; ++i) {
        number other = number(depths[i]);
        rank += other < s.depth || (other == s.depth && i < s.place) ? 1u : 0u;
    }
    indices[rank] = s.place;
}
#endif
