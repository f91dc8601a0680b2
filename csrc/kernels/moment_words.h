// Moments of absorbance in words of 16 bits, blended fragment by fragment as a render target is.
//
// Muenstermann, Krumpen, Klein and Peters, "Moment-Based Order-Independent Transparency", I3D 2018,
// section 3.4 and the matrices of its supplement. A pixel holds its total absorbance b0, as a float
// or rounded to half, and of each moment divided by b0 a word: unorm16 of
//
//     terms + offset,  terms = Q (z, z^2, ...) of a fragment, or (cos, sin) / 2 of its phase,
//
// where Q spreads the possible moments evenly over [0, 1]; odd and even powers never mix. Q is
// linear, so words need not be decoded to add a fragment of absorbance a:
//
//     new terms = (b0 old terms + a terms) / (b0 + a).
//
// The quotient is that of the sum before it is rounded to half. Every fragment rounds anew, so
// words depend on the order of arrival in their last digits.
//
// Included once for each count of nodes, with NODES defined as 2, 3 or 4 (4, 6 or 8 words).

// What a pixel stores; words are integers. Empty: all 0.
STRUCT(NAMED(stored)) {
    number word[2 * NODES];
    number b0;
};

// What a fragment has to give, and what is added to make words of it.
STRUCT(NAMED(terms)) {
    number of[2 * NODES];
    number offset[2 * NODES];
};

// The moments that words stand for.
STRUCT(NAMED(decoded)) { number b[2 * NODES]; };

// Of powers of z, in the order of words: of z, z^2, z^3, ..., odd and even in turn.
FN NAMED(terms) NAMED(power_terms)(real z) {
    PRECISE NAMED(terms) t;
    real z2 = z * z;
    real z3 = z2 * z;
    real z4 = z2 * z2;
#if NODES == 2
    t.of[0] = 1.5 * z - 2.0 * z3;
    t.of[2] = K(0.86602540378443865) * z - K(0.38490017945975051) * z3;
    t.of[1] = 4.0 * z2 - 4.0 * z4;
    t.of[3] = 0.5 * z2 + 0.5 * z4;
    t.offset[1] = K(0.0);
    t.offset[3] = K(0.0);
#elif NODES == 3
    real z5 = z4 * z;
    real z6 = z2 * z4;
    t.of[0] = (2.5 * z - 10.0 * z3) + 8.0 * z5;
    t.of[2] = (K(-1.8749986445) * z + K(4.20757543111) * z3) - K(1.83257678661) * z5;
    t.of[4] = (K(1.26583039016) * z - K(1.47644882902) * z3) + K(0.71061660238) * z5;
    t.of[1] = 4.0 * z2 - 4.0 * z4;
    t.of[3] = (9.0 * z2 - 24.0 * z4) + 16.0 * z6;
    t.of[5] = (K(-0.57759806484) * z2 + K(4.61936647543) * z4) - K(3.07953906655) * z6;
    t.offset[1] = K(0.0);
    t.offset[3] = K(0.0);
    t.offset[5] = K(0.018888946);
#else
    real z5 = z4 * z;
    real z6 = z2 * z4;
    real z7 = z6 * z;
    real z8 = z4 * z4;
    t.of[0] = ((K(3.48044635732474) * z - K(27.5760737514826) * z3) + K(55.1267384344761) * z5)
              - K(31.5311110403183) * z7;
    t.of[2] = ((K(1.26797185782836) * z - K(0.928755808743913) * z3) - K(2.07520453231032) * z5)
              + K(1.23598848322588) * z7;
    t.of[4] = ((K(-2.1671560004294) * z + K(6.17950199592966) * z3) - K(0.276515571579297) * z5)
              - K(4.23583042392097) * z7;
    t.of[6] = ((K(0.974332879165755) * z - K(0.443426830933027) * z3) - K(0.360491648368785) * z5)
              + K(0.310149466050223) * z7;
    t.of[1] = ((K(0.280504133158527) * z2 - K(0.757633844606942) * z4) + K(0.392179589334688) * z6)
              - K(0.887531871812237) * z8;
    t.of[3] = ((K(-2.01362265883247) * z2 + K(0.221551373038988) * z4) - K(1.06107954265125) * z6)
              + K(2.83887201588367) * z8;
    t.of[5] = ((K(-7.31010494985321) * z2 + K(13.9855979699139) * z4) - K(0.114305766176437) * z6)
              - K(7.4361899359832) * z8;
    t.of[7] = ((K(-15.8954215629556) * z2 + K(79.6186327084103) * z4) - K(127.457278992502) * z6)
              + K(63.7349456687829) * z8;
    t.offset[1] = K(0.972481993925964);
    t.offset[3] = K(1.0);
    t.offset[5] = K(0.999179192513328);
    t.offset[7] = K(0.991778293073131);
#endif
    for (int i = 0; i < NODES; ++i) t.offset[2 * i] = K(0.5);
    return t;
}

// Of powers of the point of the unit circle at the angle `scale` (z + 1), real and imaginary parts
// in turn. The angle is rounded in radians and powers are products, as published: words show the
// last digits of both.
FN NAMED(terms) NAMED(circle_terms)(real scale, real z) {
    PRECISE NAMED(terms) t;
    circle_point x = sine_cosine_of_angle(scale * (z + 1.0));
    real re[4];
    real im[4];
    re[0] = x.cosine;
    im[0] = x.sine;
    re[1] = re[0] * re[0] - im[0] * im[0];
    im[1] = 2.0 * re[0] * im[0];
    re[2] = re[1] * re[0] - im[1] * im[0];
    im[2] = re[1] * im[0] + im[1] * re[0];
    re[3] = re[1] * re[1] - im[1] * im[1];
    im[3] = 2.0 * re[1] * im[1];
    for (int i = 0; i < NODES; ++i) {
        t.of[2 * i] = 0.5 * re[i];
        t.of[2 * i + 1] = 0.5 * im[i];
        t.offset[2 * i] = K(0.5);
        t.offset[2 * i + 1] = K(0.5);
    }
    return t;
}

// The pixel with one fragment of absorbance `a` more. What adds nothing to an empty pixel leaves it
// empty.
FN NAMED(stored) NAMED(blended)(NAMED(stored) before, NAMED(terms) t, real a, int b0_is_half) {
    PRECISE NAMED(stored) after;
    real sum = before.b0 + a;
    after.b0 = rounded_to_single(sum);
    if (b0_is_half != 0) after.b0 = half_sum(before.b0, a);
    for (int i = 0; i < 2 * NODES; ++i) {
        real old = unorm16_value(before.word[i]) - t.offset[i];
        real mixed = (old * before.b0 + t.of[i] * a) / sum;
        real word = unorm16_word(mixed + t.offset[i]);
        after.word[i] = select(sum > 0.0, word, before.word[i]);
    }
    return after;
}

// What words hold beside their offsets.
FN NAMED(decoded) NAMED(terms_of)(NAMED(stored) s, NAMED(terms) t) {
    PRECISE NAMED(decoded) d;
    for (int i = 0; i < 2 * NODES; ++i) d.b[i] = unorm16_value(s.word[i]) - t.offset[i];
    return d;
}

// The powers that words stand for: terms through the inverse of Q, which is good to all digits of a
// double. Up to a tenth beyond [-1, 1]; 0 where b0 is.
FN NAMED(decoded) NAMED(power_decoded)(NAMED(stored) s) {
    NAMED(decoded) d = NAMED(terms_of)(s, NAMED(power_terms)(K(0.0)));
    PRECISE NAMED(decoded) m;
#if NODES == 2
    m.b[0] = K(1.7320508075688772935) * d.b[2] - K(0.33333333333333333333) * d.b[0];
    m.b[2] = K(1.2990381056766579701) * d.b[2] - 0.75 * d.b[0];
    m.b[1] = 0.125 * d.b[1] + d.b[3];
    m.b[3] = d.b[3] - 0.125 * d.b[1];
#elif NODES == 3
    m.b[0] = (K(-0.028777891919779140494) * d.b[0] + K(0.47635550421232619075) * d.b[2])
             + K(1.5524280897137293447) * d.b[4];
    m.b[2] = (K(0.099952357060244539708) * d.b[0] + K(0.84532580930693433678) * d.b[2])
             + K(1.0547257075981561032) * d.b[4];
    m.b[4] = (K(0.25893353755023665604) * d.b[0] + K(0.90779616656731598637) * d.b[2])
             + K(0.83327335646215470883) * d.b[4];
    m.b[1] = (K(0.00001253043607642957078) * d.b[1] + K(0.16668494186053158691) * d.b[3])
             + K(0.86602540579434604819) * d.b[5];
    m.b[3] = (K(-0.24998746956392357043) * d.b[1] + K(0.16668494186053158691) * d.b[3])
             + K(0.86602540579434604819) * d.b[5];
    m.b[5] = (K(-0.37498825271617834728) * d.b[1] + K(0.21876713299424836273) * d.b[3])
             + K(0.81189881793219942018) * d.b[5];
#else
    m.b[0] = ((K(-0.0048239970850239107299) * d.b[0] - K(0.42320150867423200462) * d.b[2])
              + K(0.03483123826051252653) * d.b[4])
             + K(1.671792082665923584) * d.b[6];
    m.b[2] = ((K(-0.023340221864440805196) * d.b[0] - K(0.83282909704647591006) * d.b[2])
              + K(0.019340604049962956505) * d.b[4])
             + K(1.2102150906897467141) * d.b[6];
    m.b[4] = ((K(-0.010888537031884935506) * d.b[0] - K(0.92639377299706136096) * d.b[2])
              - K(0.11723394414778901907) * d.b[4])
             + K(0.98372330181827332588) * d.b[6];
    m.b[6] = ((K(-0.030871335780673192496) * d.b[0] - K(0.93798917267024263612) * d.b[2])
              - K(0.21803337767709805278) * d.b[4])
             + K(0.84599173132299360389) * d.b[6];
    m.b[1] = ((K(-0.9762202788910356632) * d.b[1] - K(0.45613926026940109181) * d.b[3])
              - K(0.050433552101674276841) * d.b[5])
             + K(0.00083880039065109104944) * d.b[7];
    m.b[3] = ((K(-1.0482834177829956763) * d.b[1] - K(0.22972664051014932312) * d.b[3])
              + K(0.02596083346160909578) * d.b[5])
             - K(0.00133632693205861504) * d.b[7];
    m.b[5] = ((K(-1.0311526862860413797) * d.b[1] - K(0.077844420809896955123) * d.b[3])
              + K(0.0044340885101425649251) * d.b[5])
             - K(0.010374493845740556744) * d.b[7];
    m.b[7] = ((K(-0.99603844343463585194) * d.b[1] + K(0.017543862441678343321) * d.b[3])
              - K(0.036141425324396293022) * d.b[5])
             - K(0.0031783999402272497228) * d.b[7];
#endif
    for (int i = 0; i < 2 * NODES; ++i) m.b[i] = select(s.b0 > 0.0, m.b[i], K(0.0));
    return m;
}

// The same of points of the unit circle, real and imaginary parts in turn.
FN NAMED(decoded) NAMED(circle_decoded)(NAMED(stored) s) {
    NAMED(decoded) d = NAMED(terms_of)(s, NAMED(circle_terms)(K(0.0), K(0.0)));
    PRECISE NAMED(decoded) m;
    for (int i = 0; i < 2 * NODES; ++i) m.b[i] = select(s.b0 > 0.0, 2.0 * d.b[i], K(0.0));
    return m;
}
