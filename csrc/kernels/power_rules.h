// Power moments to Gauss rules, once per ray: the part of power_moments.h that needs more digits
// than float32 has. C compiles it in double only; GLSL with `real` as double.

// The coefficients of x p_k = p_{k+1} + a[k] p_k + square[k] p_{k-1} for the orthogonal polynomials
// of the moments; square[k] is the quotient of the Hankel matrix' pivots k and k - 1. Chebyshev's
// algorithm. The first pivot below `least` says that there are k nodes and no more: it is set to
// `least`, and the recurrence goes on as that of an even spread, so that what comes out always
// belongs to some distribution and its nodes of weight are the right ones. `lowest` is the least
// pivot up to that one, as it was: not above 0 where no distribution has these moments, or but one
// of NODES nodes.
STRUCT(NAMED(recurrence)) {
    number a[NODES];
    number square[NODES + 1];
    number lowest;
    number converged; // to what nodes are worth being found (lowest_root_to)
};

// Before that, b moves toward the moments of a fixed, far from degenerate distribution, by as much
// as rounding may have moved it out of the set of possible moments (MBOIT 4.1; constants in its
// supplement). Pivots of near degenerate rays are differences of nearly equal numbers: hence pairs.
FN NAMED(recurrence)
    NAMED(recurrence_of)(NAMED(moments) m, real bias, NAMED(moments) safe, real least) {
    PRECISE NAMED(recurrence) r;
    pair before[2 * NODES + 1]; // mean of p_{k-1} x^i
    pair here[2 * NODES + 1];   // mean of p_k x^i
    here[0] = pair_of(K(1.0));
    for (int i = 1; i <= 2 * NODES; ++i) {
        real b = m.b[i - 1];
        here[i] = pair_sum(pair_of(b), pair_product(pair_of(bias), exact_sum(safe.b[i - 1], -b)));
    }
    for (int i = 0; i <= 2 * NODES; ++i) before[i] = pair_of(K(0.0));
    r.converged = CONVERGED;
    r.square[0] = K(1.0);
    r.lowest = K(1.0);
    pair a = here[1];
    pair passed = here[1]; // the mean of p_k x^{k+1} over the pivot k
    pair coupling = pair_of(K(0.0));
    pair pivot = here[0];
    r.a[0] = clamp(a.high, K(-1.0), K(1.0));
    truth more = EVERYWHERE;
    for (int k = 1; k <= NODES; ++k) {
        pair next[2 * NODES + 1];
        for (int i = 0; i <= 2 * NODES; ++i) next[i] = pair_of(K(0.0));
        for (int i = k; i <= 2 * NODES - k; ++i) {
            next[i] = pair_difference(here[i + 1], pair_product(a, here[i]));
            if (k > 1) next[i] = pair_difference(next[i], pair_product(coupling, before[i]));
        }
        pair previous = pivot;
        truth enough = next[k].high > least;
        r.lowest = select(more, min(next[k].high, r.lowest), r.lowest);
        pivot = pair_select(enough, next[k], pair_of(least));
        coupling = pair_quotient(pivot, previous);
        r.square[k] = select(more, min(coupling.high, K(1.0)), K(0.25));
        more = BOTH(more, enough);
        if (k < NODES) {
            pair quotient = pair_quotient(next[k + 1], pivot);
            a = pair_difference(quotient, passed);
            passed = quotient;
            r.a[k] = select(more, clamp(a.high, K(-1.0), K(1.0)), K(0.0));
        }
        for (int i = 0; i <= 2 * NODES; ++i) {
            before[i] = here[i];
            here[i] = next[i];
        }
    }
    return r;
}

// The same by single numbers, where `least` or what the bias adds to pivots is far above what these
// round off: of moments that floats or fewer digits hold.
FN NAMED(recurrence)
    NAMED(plain_recurrence_of)(NAMED(moments) m, real bias, NAMED(moments) safe, real least) {
    PRECISE NAMED(recurrence) r;
    real before[2 * NODES + 1];
    real here[2 * NODES + 1];
    here[0] = K(1.0);
    for (int i = 1; i <= 2 * NODES; ++i) here[i] = m.b[i - 1] + bias * (safe.b[i - 1] - m.b[i - 1]);
    for (int i = 0; i <= 2 * NODES; ++i) before[i] = K(0.0);
    r.converged = K(1e-3); // then they are good to ten digits
    r.square[0] = K(1.0);
    r.lowest = K(1.0);
    real a = here[1];
    real passed = a;
    real coupling = K(0.0);
    real inverse = K(1.0); // of the pivot
    r.a[0] = clamp(a, K(-1.0), K(1.0));
    truth more = EVERYWHERE;
    for (int k = 1; k <= NODES; ++k) {
        real next[2 * NODES + 1];
        for (int i = 0; i <= 2 * NODES; ++i) next[i] = K(0.0);
        for (int i = k; i <= 2 * NODES - k; ++i) {
            next[i] = here[i + 1] - a * here[i];
            if (k > 1) next[i] = next[i] - coupling * before[i];
        }
        truth enough = next[k] > least;
        r.lowest = select(more, min(next[k], r.lowest), r.lowest);
        real pivot = select(enough, next[k], least);
        coupling = pivot * inverse;
        r.square[k] = select(more, min(coupling, K(1.0)), K(0.25));
        more = BOTH(more, enough);
        if (k < NODES) {
            inverse = 1.0 / pivot;
            real quotient = next[k + 1] * inverse;
            a = quotient - passed;
            passed = quotient;
            r.a[k] = select(more, clamp(a, K(-1.0), K(1.0)), K(0.0));
        }
        for (int i = 0; i <= 2 * NODES; ++i) {
            before[i] = here[i];
            here[i] = next[i];
        }
    }
    return r;
}

// The roots of x - level = sum of e_i / (x - g_i), i < k, one in each interval that the g leave,
// and what it takes to move one: the inverse of the slope of what is left of the equals sign less
// what is right of it.
STRUCT(NAMED(roots)) {
    number node[NODES];
    number give[NODES];
};

// That inverse where x lies so far from the g, with one division for all.
FN number NAMED(give_at)(real apart[NODES], real e[NODES], int k) {
    real product = K(1.0);
    real sum = K(0.0);
    for (int j = 0; j < k; ++j) {
        real square = apart[j] * apart[j];
        sum = sum * square + e[j] * product;
        product = product * square;
    }
    return product / max(sum + product, K(1e-300));
}

#if NODES > 1
// Of one pole, on both sides of it: their distances from it multiply to e, and differ by c.
FN NAMED(roots) NAMED(two_roots)(real level, real g, real e) {
    PRECISE NAMED(roots) r;
    for (int i = 0; i < NODES; ++i) {
        r.node[i] = level;
        r.give[i] = K(1.0);
    }
    real c = g - level;
    real root = max(sqrt(c * c + 4.0 * e), K(1e-100));
    real longer = 0.5 * (abs(c) + root);
    real shorter = e / longer;
    real part = 1.0 / root;
    truth rising = c > 0.0;
    real below = select(rising, longer, shorter);
    real above = select(rising, shorter, longer);
    r.node[0] = g - min(below, K(FARTHEST));
    r.give[0] = below * part;
    r.node[1] = g + min(above, K(FARTHEST));
    r.give[1] = above * part;
    return r;
}
#endif

// The k poles from the lowest one, or with back 1 from the highest.
FN NAMED(outer_end) NAMED(end_of_poles)(real level, real g[NODES], real e[NODES], int k, int back) {
    PRECISE NAMED(outer_end) end;
    for (int j = 0; j < NODES; ++j) {
        end.e[j] = K(0.0);
        end.gap[j] = K(1.0);
        if (j < k) {
            end.e[j] = e[j];
            end.gap[j] = g[j] - g[0];
            if (back == 1) {
                end.e[j] = e[k - 1 - j];
                end.gap[j] = g[k - 1] - g[k - 1 - j];
            }
        }
    }
    end.level = g[0] - level;
    if (back == 1) end.level = level - g[k - 1];
    end.mirrored = K(back) > 0.0;
    end.inside = EVERYWHERE;
    return end;
}

// All roots, the first so far `below` the lowest of k > 1 poles, the last `above` the highest.
FN NAMED(roots)
    NAMED(roots_within)(real level, real g[NODES], real e[NODES], int k, NAMED(outer_end) front,
                        real below, NAMED(outer_end) back, real above) {
    PRECISE NAMED(roots) r;
    real apart[NODES]; // from the g
    for (int i = 0; i < NODES; ++i) {
        r.node[i] = level;
        r.give[i] = K(1.0);
    }
    r.node[0] = g[0] - below;
    for (int j = 0; j < k; ++j) apart[j] = below + front.gap[j];
    r.give[0] = NAMED(give_at)(apart, e, k);
    r.node[k] = g[k - 1] + above;
    for (int j = 0; j < k; ++j) apart[j] = above + back.gap[j];
    r.give[k] = NAMED(give_at)(apart, back.e, k);
    // Roots sum to level and all g. So the last is known but for what rounding did to the others.
    real rest = (level + below) - above;
    for (int i = 1; i < k; ++i) {
        real offset[NODES];
        for (int j = 0; j < NODES; ++j) offset[j] = g[j] - g[i - 1];
        PRECISE NAMED(between) x;
        real v = level - g[i - 1];
        if (i == k - 1) x = NAMED(between_ends)(rest - g[i - 1], offset[i]);
        else x = NAMED(middle_guess)(K(1.0), v, e, offset, i - 1, k);
        x = NAMED(middle_root)(x, K(1.0), v, e, offset, i - 1, k, EVERYWHERE);
        r.node[i] = g[i - 1] + x.from_low;
        rest = rest + ((g[i] - g[i - 1]) - x.from_low);
        for (int j = 0; j < k; ++j) {
            if (j < i) apart[j] = x.from_low - offset[j];
            else apart[j] = x.to_high + (offset[j] - offset[i]);
        }
        r.give[i] = NAMED(give_at)(apart, e, k);
    }
    return r;
}

// `converged`: see lowest_root_to.
FN NAMED(roots)
    NAMED(interlaced_roots)(real level, real g[NODES], real e[NODES], int k, real converged) {
    PRECISE NAMED(roots) r;
    for (int i = 0; i < NODES; ++i) {
        r.node[i] = level; // the only one where k is 0
        r.give[i] = K(1.0);
    }
#if NODES > 1
    if (k == 1) r = NAMED(two_roots)(level, g[0], e[0]);
#endif
    if (k > 1) {
        const real most = K(FARTHEST);
        NAMED(outer_end) front = NAMED(end_of_poles)(level, g, e, k, 0);
        NAMED(outer_end) back = NAMED(end_of_poles)(level, g, e, k, 1);
        real below = NAMED(lowest_root_to)(converged, K(1.0), front.level, front.e, front.gap, k,
                                           most, EVERYWHERE);
        real above = NAMED(lowest_root_to)(converged, K(1.0), back.level, back.e, back.gap, k, most,
                                           EVERYWHERE);
        r = NAMED(roots_within)(level, g, e, k, front, below, back, above);
    }
    return r;
}

// The Gauss rule of fewer nodes, and that of one more: the roots of p_{k+1} are where
// x - a[k] = sum of e_i / (x - g_i).
STRUCT(NAMED(partial)) {
    number g[NODES];
    number e[NODES];
};

FN NAMED(partial) NAMED(partial_of)(NAMED(roots) found, NAMED(recurrence) c, int k) {
    PRECISE NAMED(partial) o;
    for (int i = 0; i < NODES; ++i) {
        o.g[i] = K(0.0);
        o.e[i] = K(0.0);
        if (i <= k) {
            o.g[i] = found.node[i];
            o.e[i] = c.square[k + 1] * found.give[i];
        }
    }
    return o;
}

FN NAMED(partial) NAMED(one_more_node)(NAMED(partial) fewer, NAMED(recurrence) c, int k) {
    NAMED(roots) found = NAMED(interlaced_roots)(c.a[k], fewer.g, fewer.e, k, c.converged);
    return NAMED(partial_of)(found, c, k);
}

// Of the one node that p_1 has.
FN NAMED(partial) NAMED(first_node)(NAMED(recurrence) c) {
    PRECISE NAMED(partial) o;
    for (int i = 0; i < NODES; ++i) {
        o.g[i] = K(0.0);
        o.e[i] = K(0.0);
    }
    o.g[0] = c.a[0];
    o.e[0] = c.square[1];
    return o;
}

// From the whole.
FN NAMED(rule) NAMED(rule_from)(NAMED(recurrence) c, NAMED(partial) all) {
    PRECISE NAMED(rule) r;
    r.d = c.square[1];
    for (int k = 1; k < NODES; ++k) r.d = r.d * c.square[k + 1];
    for (int i = 0; i < NODES; ++i) {
        r.g[i] = all.g[i];
        r.g_low[i] = K(0.0);
        r.e[i] = all.e[i];
    }
    return r;
}

// The n-point Gauss rule in the form that power_moments.h explains, built up node by node.
FN NAMED(rule) NAMED(rule_of)(NAMED(recurrence) c) {
    NAMED(partial) all = NAMED(first_node)(c);
    // with a count that compilers know each time
#if NODES > 1
    all = NAMED(one_more_node)(all, c, 1);
#endif
#if NODES > 2
    all = NAMED(one_more_node)(all, c, 2);
#endif
#if NODES > 3
    all = NAMED(one_more_node)(all, c, 3);
#endif
    return NAMED(rule_from)(c, all);
}

// floats: 1 of moments that floats or fewer digits hold, else 0.
FN NAMED(rule)
    NAMED(gauss_rule)(int floats, NAMED(moments) m, real bias, NAMED(moments) safe, real least) {
    PRECISE NAMED(rule) r;
    if (floats == 1) r = NAMED(rule_of)(NAMED(plain_recurrence_of)(m, bias, safe, least));
    else r = NAMED(rule_of)(NAMED(recurrence_of)(m, bias, safe, least));
    return r;
}
