// Trigonometric moments to rules, once per ray: the part of trigonometric_moments.h that needs more
// digits than float32 has. C compiles it in double only; GLSL with `real` as double.

#ifndef ARCTANGENT
#define ARCTANGENT
// The angle in (-pi/2, pi/2) with this tangent: halved twice, then a series that at this degree
// reaches the last digits.
FN number arctangent(real x) {
    real size = abs(x);
    truth steep = size > 1.0;
    real gentle = select(steep, 1.0 / max(size, K(1.0)), size);
    real half_of = gentle / (1.0 + sqrt(1.0 + gentle * gentle));
    real quarter_of = half_of / (1.0 + sqrt(1.0 + half_of * half_of));
    real square = quarter_of * quarter_of;
    real series = K(0.0);
    for (int k = 11; k > 0; --k) series = square * (K(1.0 / (2 * k + 1)) - series);
    real angle = 4.0 * (quarter_of - quarter_of * series);
    angle = select(steep, K(1.5707963267948966) - angle, angle);
    return select(x < 0.0, -angle, angle);
}
#endif

// The coefficients of Szego's recurrence x P_k = P_{k+1} + alpha_k P_k^* for the orthogonal
// polynomials of the moments, here conjugated, and its pivots, those of the Toeplitz matrix. The
// first pivot below `least` says that there are k nodes and no more: it is set to `least`, and the
// recurrence goes on as that of an even spread, and `lowest` is the least up to it (compare
// recurrence_of).
STRUCT(NAMED(circle_recurrence)) {
    number re[NODES];
    number im[NODES];
    number pivot[NODES + 1];
    number lowest;
};

FN NAMED(circle_recurrence) NAMED(circle_recurrence_of)(NAMED(circle_moments) m, real least) {
    PRECISE NAMED(circle_recurrence) r;
    real re[NODES + 1]; // P_k
    real im[NODES + 1];
    real next_re[NODES + 1];
    real next_im[NODES + 1];
    for (int i = 0; i <= NODES; ++i) {
        re[i] = K(0.0);
        im[i] = K(0.0);
    }
    re[0] = K(1.0);
    r.pivot[0] = K(1.0);
    r.lowest = K(1.0);
    truth more = EVERYWHERE;
    for (int k = 0; k < NODES; ++k) {
        real pivot = r.pivot[k];
        real mean_re = K(0.0); // of x P_k
        real mean_im = K(0.0);
        for (int i = 0; i <= k; ++i) {
            mean_re = mean_re + (re[i] * m.re[i] - im[i] * m.im[i]);
            mean_im = mean_im + (re[i] * m.im[i] + im[i] * m.re[i]);
        }
        real size = sqrt(mean_re * mean_re + mean_im * mean_im);
        real inverse = 1.0 / pivot;
        real left = (pivot - size) * ((pivot + size) * inverse);
        real enough = min(least, pivot);
        truth known = left > enough;
        r.lowest = select(more, min(left, r.lowest), r.lowest);
        r.pivot[k + 1] = select(more, max(left, enough), pivot);
        // as long as the pivot says
        real shrunk = sqrt(max((pivot - enough) * pivot, K(0.0))) / max(size, K(1e-300));
        real factor = select(more, select(known, K(1.0), shrunk), K(0.0)) * inverse;
        r.re[k] = mean_re * factor;
        r.im[k] = mean_im * factor;
        more = BOTH(more, known);
        for (int i = 0; i <= k + 1; ++i) {
            real carried_re = K(0.0);
            real carried_im = K(0.0);
            if (i > 0) {
                carried_re = re[i - 1];
                carried_im = im[i - 1];
            }
            real turned_re = K(0.0); // P_k^*
            real turned_im = K(0.0);
            if (i <= k) {
                turned_re = re[k - i];
                turned_im = -im[k - i];
            }
            next_re[i] = carried_re - (r.re[k] * turned_re - r.im[k] * turned_im);
            next_im[i] = carried_im - (r.re[k] * turned_im + r.im[k] * turned_re);
        }
        for (int i = 0; i <= k + 1; ++i) {
            re[i] = next_re[i];
            im[i] = next_im[i];
        }
    }
    return r;
}

// The moments seen from the middle of the zone, moved toward those of an even spread of depth, all
// 0.
FN NAMED(circle_moments)
    NAMED(circle_biased)(NAMED(circle_moments) m, wrapping_zone zone, real bias) {
    PRECISE NAMED(circle_moments) mixed;
    circle_point step = sine_cosine(0.5 - 2.0 * zone.turns); // half the zone
    PRECISE circle_point turn = step;
    for (int i = 0; i < NODES; ++i) {
        PRECISE circle_point b;
        b.cosine = m.re[i] - bias * m.re[i];
        b.sine = m.im[i] - bias * m.im[i];
        b = turned(b, turn);
        mixed.re[i] = b.cosine;
        mixed.im[i] = b.sine;
        turn = turned(turn, step);
    }
    return mixed;
}

// The distribution so far: its nodes and weights, the weight of the node at infinity, and the phase
// of x P_k / P_k^* there.
STRUCT(NAMED(circle_nodes)) {
    number g[NODES];
    number weight[NODES];
    number at_infinity;
    circle_point phase;
};

// With one node more than k. F(y) = m_0 y - sum of m_i (1 + y g_i) / (y - g_i), with weight m_0 of
// the node at infinity and m_i of the others, is how far the phase has turned since infinity, seen
// as a point of the line like y itself. Szego's step makes of it D(y) = offset - factor F(y), and
// the next nodes are where D(y) = y: y is where it equals a level plus a sum of poles at the nodes
// so far, one in each interval.
STRUCT(NAMED(circle_step)) {
    number level;
    number e[NODES];
    number share; // of weights that their slopes give
    number at_infinity;
    circle_point phase;
};

FN NAMED(circle_step)
    NAMED(circle_step_of)(NAMED(circle_nodes) fewer, NAMED(circle_recurrence) c, int k) {
    PRECISE NAMED(circle_step) o;
    real pivots = c.pivot[k + 1] / c.pivot[k];
    // 1 - beta, with beta the coefficient seen from there
    real re = 1.0 - (c.re[k] * fewer.phase.cosine + c.im[k] * fewer.phase.sine);
    real im = c.re[k] * fewer.phase.sine - c.im[k] * fewer.phase.cosine;
    real square = max(re * re + im * im, K(1e-30));
    real at_infinity = square * fewer.at_infinity;
    real inverse = 1.0 / (pivots + at_infinity);
    real mean = K(0.0);
    for (int i = 0; i < NODES; ++i) {
        o.e[i] = K(0.0);
        if (i < k) {
            mean = mean + fewer.weight[i] * fewer.g[i];
            o.e[i] = square * fewer.weight[i] * (1.0 + fewer.g[i] * fewer.g[i]) * inverse;
        }
    }
    o.level = (2.0 * im + square * mean) * inverse;
    o.share = pivots * inverse;
    o.at_infinity = at_infinity * inverse;
    PRECISE circle_point twice;
    real of_square = 1.0 / square;
    twice.cosine = (re * re - im * im) * of_square;
    twice.sine = 2.0 * re * im * of_square;
    o.phase = turned(fewer.phase, twice);
    return o;
}

FN NAMED(circle_nodes) NAMED(circle_nodes_of)(NAMED(circle_step) step, NAMED(roots) found, int k) {
    PRECISE NAMED(circle_nodes) o;
    for (int i = 0; i < NODES; ++i) {
        o.g[i] = K(0.0);
        o.weight[i] = K(0.0);
        if (i <= k) {
            o.g[i] = found.node[i];
            o.weight[i] = step.share * found.give[i];
        }
    }
    o.at_infinity = step.at_infinity;
    o.phase = step.phase;
    return o;
}

FN NAMED(circle_nodes)
    NAMED(one_more_circle_node)(NAMED(circle_nodes) fewer, NAMED(circle_recurrence) c, int k) {
    NAMED(circle_step) step = NAMED(circle_step_of)(fewer, c, k);
    NAMED(roots) found = NAMED(interlaced_roots)(step.level, fewer.g, step.e, k, CONVERGED);
    return NAMED(circle_nodes_of)(step, found, k);
}

// With the first two nodes beside that at infinity, from which all begins.
FN NAMED(circle_nodes) NAMED(first_circle_nodes)(NAMED(circle_recurrence) c) {
    PRECISE NAMED(circle_nodes) all;
    all.at_infinity = K(1.0);
    all.phase.cosine = K(1.0);
    all.phase.sine = K(0.0);
    for (int i = 0; i < NODES; ++i) {
        all.g[i] = K(0.0);
        all.weight[i] = K(0.0);
    }
    all = NAMED(one_more_circle_node)(all, c, 0);
    return NAMED(one_more_circle_node)(all, c, 1);
}

// Of all nodes, with the last pivot.
FN NAMED(circle_rule)
    NAMED(circle_rule_from)(NAMED(circle_nodes) all, real pivot, wrapping_zone zone) {
    PRECISE NAMED(circle_rule) r;
    real at_infinity = max(all.at_infinity, K(1e-30));
    real g[NODES];
    for (int i = 0; i < NODES; ++i) g[i] = all.g[i];
    real back = 1.0 / zone.edge;
    real of_turns = 1.0 / (zone.turns * K(6.283185307179586477));
    real of_infinity = 1.0 / at_infinity;
    real sum_front = K(0.0);
    real sum_back = K(0.0);
    r.d = pivot * of_infinity;
    for (int i = 0; i < NODES; ++i) {
        real square = 1.0 + g[i] * g[i];
        r.z[i] = arctangent(g[i]) * of_turns;
        r.z_low[i] = K(0.0);
        r.g[i] = g[i];
        r.g_low[i] = K(0.0);
        r.e[i] = all.weight[i] * square * of_infinity;
        r.d = r.d * (0.25 * square);
        sum_front = sum_front + r.e[i] / (back + g[i]);
        sum_back = sum_back + r.e[i] / (back - g[i]);
    }
    r.f_front = select(g[0] > -back, sum_front - back, K(1e30));
    r.f_back = select(g[NODES - 1] < back, back - sum_back, K(-1e30));
    return r;
}

// Built up node by node.
FN NAMED(circle_rule)
    NAMED(circle_rule_of)(NAMED(circle_moments) stored, wrapping_zone zone, real bias, real least) {
    NAMED(circle_moments) m = NAMED(circle_biased)(stored, zone, bias);
    NAMED(circle_recurrence) c = NAMED(circle_recurrence_of)(m, least);
    NAMED(circle_nodes) all = NAMED(first_circle_nodes)(c);
    // with a count that compilers know each time
#if NODES > 2
    all = NAMED(one_more_circle_node)(all, c, 2);
#endif
#if NODES > 3
    all = NAMED(one_more_circle_node)(all, c, 3);
#endif
    return NAMED(circle_rule_from)(all, c.pivot[NODES], zone);
}
