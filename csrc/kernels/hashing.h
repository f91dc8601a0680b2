// Random numbers without a state: functions of what they belong to, the same on every machine.
//
// `mixed` is the finalizer of MurmurHash3 (Appleby 2011): a permutation of 32-bit integers in which
// each bit of the argument turns over about half of the result's. Chained as here, hashes are what
// Jarzynski and Olano, "Hash Functions for GPU Rendering", JCGT 9(3), 2020, measure as nested
// hashes.

FN uint mixed(uint h) {
    uint a = (h ^ (h >> 16)) * 0x85ebca6bu;
    uint b = (a ^ (a >> 13)) * 0xc2b2ae35u;
    return b ^ (b >> 16);
}

// A key that hangs on `key` and on one thing more. No two things give the same.
FN uint joined(uint key, uint thing) { return mixed(key ^ thing); }

FN uint key_of_seed(uint seed) { return mixed(seed + 0x9e3779b9u); }

// The i-th random number of a key: Steele, Lea and Flood's SplitMix, 2014, in 32 bits.
FN uint random_bits(uint key, int i) { return mixed(key + U(i) * 0x9e3779b9u); }
FN number random_share(uint key, int i) { return share_of(random_bits(key, i)); }
