// What a fragment adds to the absorbance of its ray; a greater alpha than max_alpha is taken for it.

uniform number max_alpha;

number absorbance_of(number alpha) { return absorbance(min(alpha, max_alpha)); }
