// Power moments: from what a ray has gathered to the light that reaches a depth.
//
// The reconstruction is that of Muenstermann, Krumpen, Klein and Peters, "Moment-Based
// Order-Independent Transparency", I3D 2018 (algorithm 1): of all distributions of absorbance
// with the given moments 1, b[0] .. b[2n-1] of depth, take the one that has a node at z and n
// others; the weights of its nodes in front of z, and beta times the weight at z, are the share
// of absorbance in front of z. How it is computed here differs from published code:
//
// * Once per ray the moments become the n-point Gauss rule of their distribution: the nodes g of
//   the orthogonal polynomial p_n, the residues e of -p_{n+1}/p_n there, and the last pivot d of
//   the Hankel matrix (gauss_rule, in double precision).
// * The nodes of the distribution through z are where f(x) = f(z), with the increasing function
//   f(x) = x - sum of e_i / (x - g_i). There is one in each interval between neighbouring g but
//   the one that holds z, so how many lie in front of z is known before any is computed.
// * The weight of a node x is d / (p_n(x)^2 f'(x)): a quotient of sums of positive terms.
//
// So nothing cancels in the work per fragment, which then is good to a few float32 ulps, and no
// root is imaginary, lost or repeated. Background: Golub and Welsch 1969 (Jacobi matrices),
// R.-C. Li 1994 (iterations for f by matched poles).
//
// Included once for each count of nodes, with NODES defined as 1, 2, 3 or 4 (2, 4, 6 or 8 moments).
// Depths lie in [-1, 1] (or a part of it).

// The most steps of the iterations below, and the relative change from which a root has converged:
// a step roughly cubes the error, times a sixth at most, so what is left then is below rounding.
// Two steps do nearly always; the most are for rays that are all but degenerate.
#define LOWEST_STEPS BY_PRECISION(8, 12)
#define MIDDLE_STEPS BY_PRECISION(10, 14)
#define CONVERGED K(BY_PRECISION(5e-3, 1e-5))

// Nodes beyond this weigh nothing.
#define FARTHEST BY_PRECISION(1e4, 1e6)

// The means of the powers 1 .. 2 NODES of depth, each depth weighted by its absorbance.
STRUCT(NAMED(moments)) { number b[2 * NODES]; };

// p_n's roots in rising order as unevaluated sums g + g_low (a float32 g alone is too coarse
// where surfaces nearly coincide), residues e > 0 and pivot d > 0.
STRUCT(NAMED(rule)) {
    number g[NODES];
    number g_low[NODES];
    number e[NODES];
    number d;
};

// Where the distribution through z has its mass: the weight at z and in front of it.
STRUCT(NAMED(masses)) {
    number at;
    number in_front;
};

// The positive root of a s^2 - c s - b with a, b >= 0, from terms of one sign.
FN number NAMED(positive_root)(real a, real c, real b) {
    real root = sqrt(c * c + 4.0 * a * b);
    truth rising = c > 0.0;
    real over = select(rising, c + root, 2.0 * b);
    real under = select(rising, 2.0 * a, root - c);
    return over / max(under, K(BY_PRECISION(1e-37, 1e-300)));
}

// s / (s + gap), with one division for all.
STRUCT(NAMED(shares)) { number of[NODES]; };

FN NAMED(shares) NAMED(shares_at)(real s, real gap[NODES], int poles) {
    PRECISE NAMED(shares) o;
    real before[NODES];
    real product = K(1.0);
    for (int i = 0; i < NODES; ++i) o.of[i] = K(1.0);
    for (int i = 1; i < poles; ++i) {
        before[i] = product;
        product = product * (s + gap[i]);
    }
    real rest = s / product;
    for (int i = poles - 1; i > 0; --i) {
        o.of[i] = rest * before[i];
        rest = rest * (s + gap[i]);
    }
    return o;
}

// The distance s > 0 below the lowest pole at which
//     p s = c + p (e[0] / s + e[1] / (s + gap[1]) + ...), with e > 0, p >= 0, gap rising from 0.
// A step replaces the sum by a constant, a slope and a pole at 0 that match it in value and two
// derivatives. Times s, the third derivative of the sum has one sign and that of the others is 0,
// so they meet nowhere else: steps stay on the side of the root that they start from, and near it
// they cube the error. Worked in quotients of the last s, so that poles of very different strength
// do no harm.
FN number NAMED(lowest_root_step)(real p, real c, real e[NODES], real gap[NODES], int poles,
                                  real s) {
    NAMED(shares) share = NAMED(shares_at)(s, gap, poles);
    real level = K(0.0);
    real fall = s * s;
    real pole = e[0];
    for (int i = 1; i < poles; ++i) {
        real q = share.of[i];
        real left = 1.0 - q;
        real once = e[i] * q;
        real twice = once * q;
        level = level + (once + 2.0 * twice) * left;
        fall = fall + twice * left;
        pole = pole + twice * q;
    }
    real next = s * NAMED(positive_root)(p * fall, c * s + p * level, p * pole);
    return next;
}

// The root on its way: where it is sought, and whether a step more is worth it.
STRUCT(NAMED(sought_root)) {
    number s;
    truth more;
};

// It starts where it were with the first pole alone, and a step from there, and is sought no
// farther than `most`. Where it is not `wanted`, it is not worth more than what is done for all.
FN NAMED(sought_root) NAMED(lowest_root_start)(real p, real c, real e[NODES], real gap[NODES],
                                               int poles, real most, truth wanted) {
    const real least = K(BY_PRECISION(1e-12, 1e-60));
    PRECISE NAMED(sought_root) x;
    x.s = clamp(NAMED(positive_root)(p, c, p * e[0]), least, most);
    if (poles > 1) x.s = clamp(NAMED(lowest_root_step)(p, c, e, gap, poles, x.s), least, most);
    x.more = wanted;
    return x;
}

// A step more, until one moves it by no more than its share `converged`.
FN NAMED(sought_root)
    NAMED(lowest_root_nearer)(NAMED(sought_root) from, real converged, real p, real c,
                              real e[NODES], real gap[NODES], int poles, real most) {
    const real least = K(BY_PRECISION(1e-12, 1e-60));
    PRECISE NAMED(sought_root) x = from;
    real next = clamp(NAMED(lowest_root_step)(p, c, e, gap, poles, x.s), least, most);
    real moved = abs(next - x.s);
    x.s = select(x.more, next, x.s);
    x.more = BOTH(x.more, moved > converged * x.s);
    return x;
}

// So many steps have been taken since the start.
FN number NAMED(lowest_root_found)(NAMED(sought_root) from, int taken, real converged, real p,
                                   real c, real e[NODES], real gap[NODES], int poles, real most) {
    PRECISE NAMED(sought_root) x = from;
    for (int step = taken + 1; step < LOWEST_STEPS; ++step) {
        BREAK_UNLESS(x.more);
        x = NAMED(lowest_root_nearer)(x, converged, p, c, e, gap, poles, most);
    }
    return x.s;
}

FN number NAMED(lowest_root_to)(real converged, real p, real c, real e[NODES], real gap[NODES],
                                int poles, real most, truth wanted) {
    NAMED(sought_root) x = NAMED(lowest_root_start)(p, c, e, gap, poles, most, wanted);
    real s = x.s;
    if (poles > 1) {
        x = NAMED(lowest_root_nearer)(x, converged, p, c, e, gap, poles, most);
        s = NAMED(lowest_root_found)(x, 1, converged, p, c, e, gap, poles, most);
    }
    return s;
}

FN number NAMED(lowest_root)(real p, real c, real e[NODES], real gap[NODES], int poles, real most,
                             truth wanted) {
    return NAMED(lowest_root_to)(CONVERGED, p, c, e, gap, poles, most, wanted);
}

// A root between two neighbouring poles: its distances from both.
STRUCT(NAMED(between)) { number from_low, to_high; };

// Distances from both ends that sum to the width, near from_low and at least `tiny`.
FN NAMED(between) NAMED(between_ends)(real from_low, real width) {
    const real tiny = K(BY_PRECISION(1e-12, 1e-60));
    real whole = max(width, tiny);
    PRECISE NAMED(between) x;
    x.from_low = clamp(from_low, tiny, whole);
    x.to_high = clamp(width - from_low, tiny, whole);
    return x;
}

// The root between the poles `low` and low + 1 of
//     p (x - g[low] - sum of e[i] / (x - g[i])) = v, where offset[i] = g[i] - g[low].
// First a guess: how far it can be from either end, the other poles acting as little as they can;
// then between the two.
FN NAMED(between)
    NAMED(middle_guess)(real p, real v, real e[NODES], real offset[NODES], int low, int poles) {
    real width = offset[low + 1];
    const real tiny = K(BY_PRECISION(1e-12, 1e-60));
    real whole = max(width, tiny);
    real pull_low = e[low + 1] / whole;
    real pull_high = e[low] / whole;
    for (int i = 0; i < poles; ++i) {
        if (i < low) {
            pull_low = pull_low + e[i] / min(offset[i], -tiny);
            pull_high = pull_high + e[i] / (width - offset[i]);
        }
        if (i > low + 1) {
            pull_low = pull_low + e[i] / offset[i];
            pull_high = pull_high - e[i] / max(offset[i] - width, tiny);
        }
    }
    real far_low = NAMED(positive_root)(p, v - p * pull_low, p * e[low]);
    real far_high = NAMED(positive_root)(p, (p * width - v) - p * pull_high, p * e[low + 1]);
    far_low = clamp(far_low, tiny, whole);
    far_high = clamp(far_high, tiny, whole);
    real both = width / (far_low + far_high);
    PRECISE NAMED(between) x;
    x.from_low = max(far_low * both, tiny);
    x.to_high = max(far_high * both, tiny);
    return x;
}

// From a guess. A step gathers the others and the slope of x itself into a level and the two poles,
// matching value and two derivatives: what lies outside the interval strengthens both (Gragg's
// iteration). It, too, stays on one side of the root, and cubes the error.
FN NAMED(between) NAMED(middle_root)(NAMED(between) guess, real p, real v, real e[NODES],
                                     real offset[NODES], int low, int poles, truth wanted) {
    real width = offset[low + 1];
    const real tiny = K(BY_PRECISION(1e-12, 1e-60));
    const real least = K(BY_PRECISION(1e-37, 1e-300));
    real whole = max(width, tiny);
    real part = 1.0 / whole;
    PRECISE NAMED(between) x = guess;
    truth more = wanted;
    for (int step = 0; step < MIDDLE_STEPS; ++step) {
        BREAK_UNLESS(more);
        // what `left` and `right` gain, over the cubes of the distances and width
        real gain_left = K(1.0);
        real gain_right = K(1.0);
        real level = 2.0 * x.from_low - x.to_high;
        for (int i = 0; i < poles; ++i) {
            if (i < low || i > low + 1) {
                real away = x.from_low - offset[i];
                if (i > low + 1) away = (width - offset[i]) - x.to_high;
                real r = 1.0 / away;
                real to_low = -(offset[i] * r);
                real to_high = (width - offset[i]) * r;
                real pull = e[i] * r;
                level = level - pull * to_low * to_high;
                pull = pull * r;
                gain_left = gain_left + pull * to_high;
                gain_right = gain_right + pull * to_low;
            }
        }
        // level - left / from_low + right / to_high = 0, with from_low + to_high = width
        real square_low = x.from_low * x.from_low;
        real square_high = x.to_high * x.to_high;
        real left = p * (e[low] + square_low * (x.from_low * part) * gain_left);
        real right = p * (e[low + 1] + square_high * (x.to_high * part) * gain_right);
        real tilt = (p * level - v) * width;
        real turn = tilt - left + right;
        real root = sqrt(turn * turn + 4.0 * left * right);
        real sum_low = left + right + tilt;
        real sum_high = left + right - tilt;
        truth near_low = sum_low > 0.0;
        truth near_high = sum_high > 0.0;
        real over_low = select(near_low, 2.0 * left, root - sum_low);
        real under_low = select(near_low, sum_low + root, -(2.0 * tilt));
        real over_high = select(near_high, 2.0 * right, root - sum_high);
        real under_high = select(near_high, sum_high + root, 2.0 * tilt);
        real from_low = clamp(width * (over_low / max(under_low, least)), tiny, whole);
        real to_high = clamp(width * (over_high / max(under_high, least)), tiny, whole);
        real moved_low = abs(from_low - x.from_low) * x.to_high;
        real moved_high = abs(to_high - x.to_high) * x.from_low;
        real scale = x.from_low * x.to_high;
        x.from_low = select(more, from_low, x.from_low);
        x.to_high = select(more, to_high, x.to_high);
        more = BOTH(more, max(moved_low, moved_high) > CONVERGED * scale);
    }
    return x;
}

// d / (p_n(x)^2 f'(x)), the weight of a node x, from its distances to the g.
FN number NAMED(node_weight)(real apart[NODES], real e[NODES], real d) {
    real product = K(1.0);
    real sum = K(0.0);
    for (int i = 0; i < NODES; ++i) {
        // sum of e_i prod_{j != i} apart_j^2, built up pole by pole
        real square = apart[i] * apart[i];
        sum = sum * square + e[i] * product;
        product = product * square;
    }
    return min(d / max(sum + product, K(BY_PRECISION(1e-37, 1e-300))), K(1.0));
}

// z among the nodes of a rule. p and q are p_n(z) and p_n(z) times the sum of e_i / (z - g_i), both
// with the sign that makes p >= 0: with f(x) = f(z) multiplied by p, z may lie on a g.
STRUCT(NAMED(place)) {
    number from[NODES]; // z - g
    number first;       // the product of all `from` but the first
    number p;
    number q;
    number at; // weight of the node z
};

// z's distances from the nodes of a rule: z - g.
STRUCT(NAMED(distances)) { number from[NODES]; };

FN NAMED(place) NAMED(place_among)(NAMED(distances) z, real e[NODES], real d) {
    PRECISE NAMED(place) o;
    real others[NODES]; // products of all `from` but one
    real sign = K(1.0); // that of p_n(z) just in front of z, where p_n(z) may be 0
    real p = K(1.0);
    for (int i = 0; i < NODES; ++i) {
        o.from[i] = z.from[i];
        others[i] = p;
        p = p * o.from[i];
        sign = select(o.from[i] > 0.0, sign, -sign);
    }
    real behind = K(1.0);
    for (int i = NODES - 1; i >= 0; --i) {
        others[i] = others[i] * behind;
        behind = behind * o.from[i];
    }
    real q = K(0.0);
    for (int i = 0; i < NODES; ++i) q = q + e[i] * others[i];
    o.p = abs(p);
    o.q = sign * q;
    o.first = abs(others[0]);
    o.at = NAMED(node_weight)(o.from, e, d);
    return o;
}

FN NAMED(place) NAMED(place_of)(NAMED(rule) r, real z) {
    PRECISE NAMED(distances) o;
    for (int i = 0; i < NODES; ++i) o.from[i] = (z - r.g[i]) - r.g_low[i];
    return NAMED(place_among)(o, r.e, r.d);
}

// A ray seen from one of its ends: residues and gaps from there, and the level of which the node
// that lies farthest out is the root (lowest_root_step). That one counts only where z is `inside`.
STRUCT(NAMED(outer_end)) {
    number e[NODES];
    number gap[NODES];
    number level;
    truth mirrored; // seen from the far end
    truth inside;
};

#if NODES > 2
// From the end with fewer nodes between it and z.
FN NAMED(outer_end) NAMED(outer_end_of)(NAMED(rule) r, NAMED(place) o) {
    PRECISE NAMED(outer_end) end;
    end.mirrored = o.from[NODES / 2] > 0.0;
    for (int i = 0; i < NODES; ++i) {
        int k = NODES - 1 - i;
        real above = (r.g[i] - r.g[0]) + (r.g_low[i] - r.g_low[0]);
        real below = (r.g[NODES - 1] - r.g[k]) + (r.g_low[NODES - 1] - r.g_low[k]);
        end.e[i] = select(end.mirrored, r.e[k], r.e[i]);
        end.gap[i] = select(end.mirrored, below, above);
    }
    real ahead = select(end.mirrored, -o.from[NODES - 1], o.from[0]);
    end.level = select(end.mirrored, -o.q, o.q) - o.p * ahead; // p (g - f(z)) at that end
    end.inside = BOTH(o.from[0] > 0.0, o.from[NODES - 1] <= 0.0);
    return end;
}

// Weights, as below, where the outermost node lies s beyond the end.
FN NAMED(masses)
    NAMED(masses_from_end)(NAMED(rule) r, NAMED(place) o, NAMED(outer_end) end, real s) {
    PRECISE NAMED(masses) mass;
    mass.at = o.at;
    real apart[NODES];
    for (int i = 0; i < NODES; ++i) apart[i] = s + end.gap[i];
    real outermost = NAMED(node_weight)(apart, end.e, r.d);
    real ends = select(end.mirrored, (1.0 - mass.at) - outermost, outermost);
#if NODES == 4
    // z between the second and third g: two nodes in front, the second in the first interval.
    PRECISE NAMED(between) x;
    real offset[NODES];
    for (int i = 0; i < NODES; ++i) offset[i] = (r.g[i] - r.g[0]) + (r.g_low[i] - r.g_low[0]);
    truth middle = BOTH(o.from[1] > 0.0, o.from[2] <= 0.0);
    x = NAMED(middle_guess)(o.p, o.p * o.from[0] - o.q, r.e, offset, 0, NODES);
    x = NAMED(middle_root)(x, o.p, o.p * o.from[0] - o.q, r.e, offset, 0, NODES, middle);
    apart[0] = x.from_low;
    apart[1] = x.to_high;
    apart[2] = (offset[2] - offset[1]) + x.to_high;
    apart[3] = (offset[3] - offset[1]) + x.to_high;
    real second = NAMED(node_weight)(apart, r.e, r.d);
    truth central = o.from[1] > 0.0;
    ends = select(end.mirrored, ends, select(central, outermost + second, outermost));
#endif
    mass.in_front = select(o.from[0] > 0.0, ends, K(0.0));
    mass.in_front = select(o.from[NODES - 1] > 0.0, 1.0 - mass.at, mass.in_front);
    mass.in_front = clamp(mass.in_front, K(0.0), 1.0 - mass.at);
    return mass;
}
#endif

// Weight at z and in front of z of the distribution with a node at z (algorithm 1's w_0, and the
// sum of its w_l with z_l < z).
FN NAMED(masses) NAMED(masses_at)(NAMED(rule) r, real z) {
    NAMED(place) o = NAMED(place_of)(r, z);
    PRECISE NAMED(masses) mass;
#if NODES == 1
    // Two nodes in all: z, and one on the other side of the mean (Cantelli).
    mass.at = o.at;
    mass.in_front = select(o.from[0] > 0.0, 1.0 - mass.at, K(0.0));
    mass.in_front = clamp(mass.in_front, K(0.0), 1.0 - mass.at);
#elif NODES == 2
    // One node in front of z, if any but not all: f(x) = f(z) without the root x = z is quadratic.
    mass.at = o.at;
    real gap = (r.g[1] - r.g[0]) + (r.g_low[1] - r.g_low[0]);
    real apart[NODES];
    apart[0] = NAMED(positive_root)(o.p, o.q - o.p * gap, r.e[0] * o.first * gap);
    apart[0] = min(apart[0], K(FARTHEST));
    apart[1] = apart[0] + gap;
    real lowest = NAMED(node_weight)(apart, r.e, r.d);
    mass.in_front = select(o.from[1] > 0.0, 1.0 - mass.at, select(o.from[0] > 0.0, lowest, K(0.0)));
    mass.in_front = clamp(mass.in_front, K(0.0), 1.0 - mass.at);
#else
    // Few nodes lie on one side of z; where it is the far side, look at the ray from its end.
    NAMED(outer_end) end = NAMED(outer_end_of)(r, o);
    real s = NAMED(lowest_root)(o.p, end.level, end.e, end.gap, NODES, K(FARTHEST), end.inside);
    mass = NAMED(masses_from_end)(r, o, end, s);
#endif
    return mass;
}

// The absorbance in front of z on a ray of total absorbance b0, overestimating occlusion by the
// share beta of what may lie at z (MBOIT 3.2). `own` is the absorbance of the surface that asks,
// which does not occlude itself, or 0 as published. An empty ray gives 0.
FN number NAMED(absorbance_past)(NAMED(masses) mass, real b0, real own, real beta) {
    real in_front = b0 * mass.in_front + beta * max(b0 * mass.at - own, K(0.0));
    in_front = clamp(in_front, K(0.0), max(b0 - own, K(0.0)));
    return select(b0 > 0.0, in_front, K(0.0));
}

FN number NAMED(absorbance_before)(NAMED(rule) r, real b0, real z, real own, real beta) {
    NAMED(masses) mass = NAMED(masses_at)(r, z);
    return NAMED(absorbance_past)(mass, b0, own, beta);
}

// The transmittance in front of z; an empty ray gives 1.
FN number NAMED(transmittance)(NAMED(rule) r, real b0, real z, real own, real beta) {
    real in_front = NAMED(absorbance_before)(r, b0, z, own, beta);
    return exponential(-in_front);
}
