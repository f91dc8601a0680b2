// A pixel's fragments from front to back, those at one depth in order of arrival:
// in `indices`, from
// offsets[p] on, once the pass RANK has run.
//
//   CORE_ALPHA   what has less alpha comes after all others; else not defined

#ifdef CORE_ALPHA
bool is_faint(uint i) { return alphas[i] < SCALAR(CORE_ALPHA); }
#else
bool is_faint(uint i) { return false; }
#endif

#if PASS == RANK
void own_pass(uint p, surface s) {
    uint rank = offsets[p];
    uint end = offsets[p + 1u];
    bool faint = is_faint(s.place);
    for (uint i = offsets[p]; i < end; ++i) {
        number other = number(depths[i]);
        bool alike = is_faint(i) == faint, before = i < s.place;
        // what is faint stands in order of arrival: that is all that anybody asks of it
        bool nearer = other < s.depth || (other == s.depth && before);
        rank += alike ? (faint ? before : nearer) ? 1u : 0u : faint ? 1u : 0u;
    }
    indices[rank] = s.place;
}
#endif
