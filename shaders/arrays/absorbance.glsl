// What a fragment adds to the absorbance of its ray; a greater alpha than max_alpha is taken for
// it.

uniform number max_alpha;
uniform uint exclude_self; // 1: a fragment does not occlude itself

number absorbance_of(number alpha) { return absorbance(min(alpha, max_alpha)); }

// What of its ray's absorbance a fragment knows not to lie in front of it.
number own_absorbance(number alpha) { return exclude_self == 1u ? absorbance_of(alpha) : K(0.0); }
