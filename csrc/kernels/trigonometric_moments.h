// Trigonometric moments: from what a ray has gathered to the light that reaches a depth.
//
// The reconstruction is that of Muenstermann, Krumpen, Klein and Peters, "Moment-Based
// Order-Independent Transparency", I3D 2018 (algorithm 2): depth z lies on the unit circle at the
// angle (2 pi - theta)(z + 1)/2 (eq. 5), and of all distributions of absorbance with the given
// moments E[x^j], j = 1 .. n, take the one with a node at z and n others. Its nodes count as eq. 6
// says: in front of z with their weight, behind z not, and in the wrapping zone, the angle theta
// that no depth has, by how near they are to the front. How it is computed here differs from
// published code:
//
// * The circle is seen as a line, y = tan of half the angle from its middle, z = 0; the middle of
//   the wrapping zone is at infinity. Trigonometric polynomials of order n become polynomials in y
//   of degree 2n over (1 + y^2)^n, so the n trigonometric moments are 2n + 1 power moments in
//   disguise, and all that power_moments.h does with a rule serves here.
// * Once per ray the moments become that rule: the distribution with a node at infinity, its other
//   nodes g and their residues e (circle_rule_of, in double precision).
// * The nodes of the distribution through z are where f(y) = f(y(z)), with the increasing function
//   f(y) = y - sum of e_i / (y - g_i), one in each of the n + 1 intervals that the g leave. Only
//   those in the outermost two can lie in the wrapping zone.
// * The weight of a node y is d (1 + y^2)^n / (p(y)^2 f'(y)), with p(y) = product of (y - g_i): a
//   quotient of sums of positive terms.
//
// Background: Szego's orthogonal polynomials on the unit circle; Jones, Njastad and Thron 1989
// (para-orthogonal polynomials).
//
// Included once for each count of nodes, with NODES defined as 2, 3 or 4, the count of moments,
// after power_moments.h. Depths lie in [-1, 1].

// What the wrapping zone's angle theta comes to.
#ifndef WRAPPING_ZONE
#define WRAPPING_ZONE
STRUCT(wrapping_zone) {
    number turns; // of half the angle between z = 0 and z = 1: 1/4 - theta / (8 pi)
    number edge;  // tan(theta / 4): the zone is where |1/y| is less
    number scale; // of what eq. 6 takes off 1; 0 where there is no zone
};

// y of a depth; where there is no zone, z = -1 and 1 stay this side of infinity.
FN number on_the_line(wrapping_zone zone, real z) {
    circle_point p = sine_cosine(z * zone.turns);
    real y = p.sine / max(p.cosine, K(BY_PRECISION(1e-4, 1e-6)));
    return y;
}

// Eq. 6 in the zone, as a function of 1/y from edge, at the far end of depth, to -edge, where
// angles start again: with t the tangent of half the angle that is left, 7 - psi = 2 t (1 + t) / (1
// + t^2).
FN number wrapped_share(wrapping_zone zone, real inverse) {
    real left = (zone.edge + inverse) * ((1.0 + zone.edge) + (1.0 - zone.edge) * inverse);
    real share = 1.0 - zone.scale * left / (1.0 + inverse * inverse);
    return clamp(share, K(0.0), K(1.0));
}
#endif

// The means of x^1 .. x^n, each depth weighted by its absorbance: real parts and imaginary parts.
STRUCT(NAMED(circle_moments)) {
    number re[NODES];
    number im[NODES];
};

// All nodes but that at infinity in rising order, as unevaluated sums: their depths, which may lie
// beyond 1 in the zone, and their y. Residues e > 0, d > 0, and f at the zone's ends.
STRUCT(NAMED(circle_rule)) {
    number z[NODES];
    number z_low[NODES];
    number g[NODES];
    number g_low[NODES];
    number e[NODES];
    number d;
    number f_front;
    number f_back;
};

// (1 + y^2)^n
FN number NAMED(circle_scale)(real y) {
    real square = 1.0 + y * y;
    real scale = square;
    for (int i = 1; i < NODES; ++i) scale = scale * square;
    return scale;
}

// The weight of a node y however far out, from its distances to the g; inverse: 1 / max(|y|, 1).
FN number NAMED(far_weight)(real y, real inverse, real apart[NODES], real e[NODES], real d) {
    real square = inverse * inverse;
    real nearer[NODES];
    real weaker[NODES];
    for (int i = 0; i < NODES; ++i) {
        nearer[i] = apart[i] * inverse;
        weaker[i] = e[i] * square;
    }
    real part = square + (y * inverse) * (y * inverse); // of 1 + y^2
    real scale = part;
    for (int i = 1; i < NODES; ++i) scale = scale * part;
    return NAMED(node_weight)(nearer, weaker, d * scale);
}

// y(z) - g. Where z is near a node its depth tells the difference better:
// tan a - tan b = tan(a - b) (1 + tan a tan b).
FN NAMED(distances)
    NAMED(circle_distances)(NAMED(circle_rule) r, wrapping_zone zone, real z, real y) {
    PRECISE NAMED(distances) o;
    for (int i = 0; i < NODES; ++i) {
        real turns = ((z - r.z[i]) - r.z_low[i]) * zone.turns;
        real angle = turns * K(6.283185307179586477);
        real square = angle * angle;
        real series = K(0.0); // of the tangent, for an angle up to 1/8
        if (BY_PRECISION(0, 1) > 0) {
            series = square * K(929569.0 / 638512875.0);
            series = square * (K(21844.0 / 6081075.0) + series);
            series = square * (K(1382.0 / 155925.0) + series);
        }
        series = square * (K(62.0 / 2835.0) + series);
        series = square * (K(17.0 / 315.0) + series);
        series = square * (K(2.0 / 15.0) + series);
        series = square * (K(1.0 / 3.0) + series);
        real near = (angle + angle * series) * (1.0 + y * r.g[i]);
        real far = (y - r.g[i]) - r.g_low[i];
        o.from[i] = select(abs(angle) < K(0.125), near, far);
    }
    return o;
}

// z among the nodes of a rule (place_among), p and q as shares, since roots may lie far out. The
// outermost nodes: where most lie in front of z, those behind are counted, so that an outermost
// node on the other side counts only in the zone.
STRUCT(NAMED(circle_place)) {
    number from[NODES];
    number p;
    number q;
    number at;
    truth most_ahead;
    truth first_wanted;
    truth last_wanted;
};

FN NAMED(circle_place) NAMED(circle_place_of)(NAMED(circle_rule) r, wrapping_zone zone, real z) {
    real y = on_the_line(zone, z);
    NAMED(distances) apart_from_z = NAMED(circle_distances)(r, zone, z, y);
    NAMED(place) found = NAMED(place_among)(apart_from_z, r.e, r.d * NAMED(circle_scale)(y));
    PRECISE NAMED(circle_place) o;
    for (int i = 0; i < NODES; ++i) o.from[i] = found.from[i];
    o.at = found.at;
    o.most_ahead = o.from[NODES / 2] > 0.0;
    real part = 1.0 / max(found.p + abs(found.q), K(BY_PRECISION(1e-37, 1e-300)));
    o.p = found.p * part;
    o.q = found.q * part;
    real level = o.p * y - o.q;
    real first_counts = select(o.most_ahead, o.p * r.f_front - level, o.from[0]);
    real last_counts = select(o.most_ahead, -o.from[NODES - 1], level - o.p * r.f_back);
    o.first_wanted = first_counts > 0.0;
    o.last_wanted = last_counts >= 0.0;
    return o;
}

#define CIRCLE_FARTHEST BY_PRECISION(1e6, 1e12)

// The ray from one of its ends; back: 1 from the far one, else 0.
FN NAMED(outer_end) NAMED(circle_end_of)(NAMED(circle_rule) r, NAMED(circle_place) o, int back) {
    PRECISE NAMED(outer_end) end;
    for (int i = 0; i < NODES; ++i) {
        int k = NODES - 1 - i;
        if (back == 1) {
            end.e[i] = r.e[k];
            end.gap[i] = (r.g[NODES - 1] - r.g[k]) + (r.g_low[NODES - 1] - r.g_low[k]);
        } else {
            end.e[i] = r.e[i];
            end.gap[i] = (r.g[i] - r.g[0]) + (r.g_low[i] - r.g_low[0]);
        }
    }
    end.level = o.q - o.p * o.from[0];
    end.inside = o.first_wanted;
    end.mirrored = K(back) > 0.0;
    if (back == 1) {
        end.level = o.p * o.from[NODES - 1] - o.q;
        end.inside = o.last_wanted;
    }
    return end;
}

// What of the weight of the outermost node counts, which lies s beyond that end.
FN number NAMED(counted_end)(NAMED(circle_rule) r, wrapping_zone zone, NAMED(circle_place) o,
                             NAMED(outer_end) end, int back, real s) {
    real apart[NODES];
    for (int i = 0; i < NODES; ++i) apart[i] = s + end.gap[i];
    real root = r.g[0] - s, outward = -root;
    if (back == 1) {
        root = r.g[NODES - 1] + s;
        outward = root;
    }
    real inverse = 1.0 / max(abs(root), K(1.0));
    real weight = NAMED(far_weight)(root, inverse, apart, end.e, r.d);
    real past = min(select(outward > 0.0, inverse, zone.edge), zone.edge);
    if (back == 0) past = -past;
    real share = wrapped_share(zone, past);
    weight = select(o.most_ahead, weight * (1.0 - share), weight * share);
    return select(end.inside, weight, K(0.0));
}

// Weight at z and in front of z, where so much of the outermost nodes and of others counts.
FN NAMED(masses) NAMED(circle_masses)(NAMED(circle_place) o, real ends) {
    PRECISE NAMED(masses) mass;
    mass.at = o.at;
    mass.in_front = select(o.most_ahead, (1.0 - mass.at) - ends, ends);
    mass.in_front = clamp(mass.in_front, K(0.0), 1.0 - mass.at);
    return mass;
}

#if NODES == 4
// Where z lies between the second and third g there are two nodes in front: the weight of the
// second, which is in the first interval.
FN number NAMED(second_weight)(NAMED(circle_rule) r, NAMED(circle_place) o) {
    PRECISE NAMED(between) x;
    real apart[NODES];
    real offset[NODES];
    for (int i = 0; i < NODES; ++i) offset[i] = (r.g[i] - r.g[0]) + (r.g_low[i] - r.g_low[0]);
    truth middle = BOTH(o.from[1] > 0.0, o.from[2] <= 0.0);
    x = NAMED(middle_guess)(o.p, o.p * o.from[0] - o.q, r.e, offset, 0, NODES);
    x = NAMED(middle_root)(x, o.p, o.p * o.from[0] - o.q, r.e, offset, 0, NODES, middle);
    apart[0] = x.from_low;
    apart[1] = x.to_high;
    apart[2] = (offset[2] - offset[1]) + x.to_high;
    apart[3] = (offset[3] - offset[1]) + x.to_high;
    real second = NAMED(node_weight)(apart, r.e, r.d * NAMED(circle_scale)(r.g[0] + x.from_low));
    return select(middle, second, K(0.0));
}
#endif

// Weight at z and in front of z (eq. 6) of the distribution with a node at z.
FN NAMED(masses) NAMED(circle_masses_at)(NAMED(circle_rule) r, wrapping_zone zone, real z) {
    NAMED(circle_place) o = NAMED(circle_place_of)(r, zone, z);
    const real most = K(CIRCLE_FARTHEST);
    NAMED(outer_end) end = NAMED(circle_end_of)(r, o, 0);
    real s = NAMED(lowest_root)(o.p, end.level, end.e, end.gap, NODES, most, end.inside);
    real first = NAMED(counted_end)(r, zone, o, end, 0, s);
    end = NAMED(circle_end_of)(r, o, 1);
    s = NAMED(lowest_root)(o.p, end.level, end.e, end.gap, NODES, most, end.inside);
    real last = NAMED(counted_end)(r, zone, o, end, 1, s);
    real ends = first + last;
#if NODES == 4
    ends = ends + NAMED(second_weight)(r, o);
#endif
    return NAMED(circle_masses)(o, ends);
}

// As those of power moments.
FN number NAMED(circle_absorbance_before)(NAMED(circle_rule) r, wrapping_zone zone, real b0, real z,
                                          real own, real beta) {
    NAMED(masses) mass = NAMED(circle_masses_at)(r, zone, z);
    return NAMED(absorbance_past)(mass, b0, own, beta);
}

FN number NAMED(circle_transmittance)(NAMED(circle_rule) r, wrapping_zone zone, real b0, real z,
                                      real own, real beta) {
    real in_front = NAMED(circle_absorbance_before)(r, zone, b0, z, own, beta);
    return exponential(-in_front);
}
