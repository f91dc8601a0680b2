// What a part of a stroke covers of a pixel, and of parts that follow one another and meet there
// one layer: the steps of csrc/core/stroke_layers.c, and its bits.
//
//   SHADOWED   0 or 1: what is drawn knows what of each light comes there
#include "meshes/strokes.glsl"
#include "arrays/begin_double.glsl"
#include "kernels/surface.h" // in double
#include "kernels/strokes.h" // in double
#include "arrays/end_double.glsl"

uniform dvec4 sight;      // a place's direction: sight.xz + its place times sight.yw
uniform dvec2 seen_range; // of depth
uniform dvec2 spans;      // how many units the picture has each way, at distance 1, over 2
uniform int lights;       // how many there are; 0: one that kernels/surface.h has
uniform double light_numbers[6 * MOST_LIGHTS]; // of each where it travels and its colour

// As moit_stroke_layer. own_near, own_far: of its last part, which is the record `last`.
struct stroke_layer {
    uvec2 covered;
    int last;
    double near;
    double far;
    double own_near;
    double own_far;
    double depth;
    double alpha;
    double color[3];
    double share[MOST_LIGHTS];
};

// Ranks of the samples of three layers. Apart from these: what copies arrays with structs, number
// by number, llvmpipe takes seconds to compile.
const int OWN_ROW = 0, LAYER_ROW = 1, WHOLE_ROW = 2;
float ranks[3 * MOST_SAMPLES];

void copy_ranks(int to, int from, int count) {
    for (int i = 0; i < count; ++i) ranks[MOST_SAMPLES * to + i] = ranks[MOST_SAMPLES * from + i];
}

const double CORNER = 0.70711lf;
const int CORNERS = 4;
const int FIRST_SAMPLE = CORNERS + 1; // the middle of the pixel comes before

int bits_of(uvec2 covered) { return bitCount(covered.x) + bitCount(covered.y); }

bool is_covered(uvec2 covered, int i) { return ((i < 32 ? covered.x : covered.y) >> (i & 31) & 1u) == 1u; }

dvec2 sample_at(int i) {
    int turned = int(bitfieldReverse(uint(i)) >> 26);
    return dvec2((double(i) + 0.5lf) / 64.0lf, (double(turned) + 0.5lf) / 64.0lf);
}

stroke_outline outline_of(int i) {
    stroke_outline o;
    for (int k = 0; k < 2; ++k) {
        o.x[k] = strokes[i].x[k];
        o.y[k] = strokes[i].y[k];
        o.radius[k] = strokes[i].radius[k];
        o.along[k] = strokes[i].along[k];
    }
    o.apart = strokes[i].apart;
    o.lean = strokes[i].lean;
    o.upright = strokes[i].upright;
    return o;
}

stroke_balls balls_of(int i) {
    stroke_balls o;
    for (int k = 0; k < 6; ++k) o.at[k] = strokes[i].at[k];
    for (int k = 0; k < 2; ++k) o.outside[k] = strokes[i].outside[k];
    o.over = strokes[i].over;
    o.per_over = strokes[i].per_over;
    o.start = strokes[i].start;
    o.beyond = strokes[i].beyond;
    o.near = seen_range.x;
    o.far = seen_range.y;
    return o;
}

bool has(int i, int what) { return (strokes[i].how & what) != 0; }

stroke_point met_at(int i, stroke_outline outline, stroke_balls balls, dvec2 at) {
    if (!has(i, STROKE_SOLID))
        return flat_stroke_at(outline, balls.at[2], balls.at[5], at.x, at.y, strokes[i].holder);
    precise double right = sight.x + at.x * sight.y, up = sight.z + at.y * sight.w;
    return solid_stroke_at(balls, right, up, 0);
}

// Sums of what is met at `at`, for so many samples.
void take(int i, stroke_balls balls, stroke_point p, dvec2 at, int count, inout stroke_layer o) {
    precise double times = double(count);
    o.depth = times * (has(i, STROKE_SOLID) && !has(i, STROKE_PIXELS) ? p.rank : p.middle);
    precise double more = double(strokes[i].opacity[1] - strokes[i].opacity[0]);
    precise double alpha = times * (double(strokes[i].opacity[0]) + p.share * more);
    o.alpha = alpha;
    for (int k = 0; k < 3; ++k) {
        precise double redder = double(strokes[i].color[3 + k] - strokes[i].color[k]);
        precise double shade = times * (double(strokes[i].color[k]) + p.share * redder);
        o.color[k] = shade;
    }
    for (int k = 0; k < MOST_LIGHTS; ++k) o.share[k] = 0.0lf;
    if (!has(i, STROKE_SOLID) || !has(i, STROKE_LIT)) return;
    precise double ray_right = sight.x + at.x * sight.y, ray_up = sight.z + at.y * sight.w;
    precise stroke_normal normal = normal_of_stroke(balls, p, ray_right, ray_up);
    precise double right = (2.0lf * at.x / double(picture.x) - 1.0lf) / spans.x;
    precise double up = (1.0lf - 2.0lf * at.y / double(picture.y)) / spans.y;
    for (int light = 0; light < max(lights, 1); ++light) {
        double along[3];
        for (int k = 0; k < 3; ++k) along[k] = light_numbers[6 * light + k];
        precise double share = lights > 0 ? facing_light(normal.along, right, up, along)
                                          : lambert(normal.along, right, up);
        o.share[light] = share * times;
    }
}

// What a part covers of a pixel; false: nothing. One loop, so that what meets is written once:
// corners and the middle, then samples, then what their middle has.
bool covers(int i, ivec2 pixel, out stroke_layer o) {
    stroke_outline outline = outline_of(i);
    stroke_balls balls = balls_of(i);
    bool solid = has(i, STROKE_SOLID), sampled = has(i, STROKE_SAMPLED);
    precise dvec2 corner = dvec2(pixel), at, sum = dvec2(0.0lf);
    precise double away = away_from_outline(outline, corner.x + 0.5lf, corner.y + 0.5lf,
                                            strokes[i].holder)
                              .away;
    if (strokes[i].everywhere == 1) away = 0.0lf;
    bool asks_all = sampled && (solid ? away <= CORNER / 2.0lf : away < -CORNER);
    bool all_corners = asks_all, taken = false;
    o.covered = uvec2(0u);
    o.last = i;
    o.near = 1.7976931348623157e308lf;
    o.far = -o.near;
    int count = sampled ? MOST_SAMPLES : 1;
    if (pixel.x < strokes[i].left || pixel.x >= strokes[i].right || pixel.y < strokes[i].top
        || pixel.y >= strokes[i].bottom || away > CORNER)
        count = -FIRST_SAMPLE - 3; // it covers nothing
    // after samples: their middle; the first that is covered
    for (int k = asks_all ? 0 : FIRST_SAMPLE; k < FIRST_SAMPLE + count + 2 && !taken; ++k) {
        int index = k - FIRST_SAMPLE, covered = bits_of(o.covered);
        at = corner + dvec2(0.5lf);
        if (k < CORNERS) at = corner + dvec2(double(k % 2), double(k / 2));
        else if (index >= 0 && index < count) {
            if (sampled) at = corner + sample_at(index);
        } else if (index == count) {
            if (covered == 0) break;
            at = corner + sum / double(covered);
        } else if (index > count)
            at = corner
                 + sample_at(o.covered.x != 0u ? findLSB(o.covered.x) : 32 + findLSB(o.covered.y));
        precise stroke_point p = met_at(i, outline, balls, at);
        if (k < CORNERS) {
            all_corners = all_corners && (p.met || !solid);
            continue;
        }
        bool whole = k == CORNERS && all_corners && p.met;
        if (k == CORNERS && !whole) continue;
        precise double thickness =
            strokes[i].size[0] + p.share * (strokes[i].size[1] - strokes[i].size[0]);
        precise double near = p.middle - thickness, far = p.middle + thickness;
        if (p.met) {
            o.near = near < o.near ? near : o.near;
            o.far = far > o.far ? far : o.far;
        }
        bool alone = index == 0 && !sampled;
        if (whole) {
            o.covered = uvec2(~0u);
            for (int n = 0; n < count; ++n) ranks[MOST_SAMPLES * OWN_ROW + n] = float(p.rank);
        } else if (index < count && p.met) {
            if (index < 32) o.covered.x |= 1u << index;
            else o.covered.y |= 1u << (index - 32);
            ranks[MOST_SAMPLES * OWN_ROW + index] = float(p.rank);
            if (sampled) sum += sample_at(index);
        }
        taken = (whole || alone || index >= count) && p.met;
        if (taken) take(i, balls, p, at, bits_of(o.covered), o);
        if (alone) break;
    }
    o.own_near = o.near;
    o.own_far = o.far;
    return taken;
}

// As moit_stroke_goes_on: own is [near, far] of the part i.
bool goes_on(stroke_layer o, double near, double far, int i, int end, ivec2 pixel) {
    if (o.near <= far && near <= o.far) return true;
    precise double dx = strokes[i].x[end] - double(pixel.x) - 0.5lf;
    precise double dy = strokes[i].y[end] - double(pixel.y) - 0.5lf;
    precise double reach = strokes[i].radius[end] + CORNER;
    precise double away = dx * dx + dy * dy, most = reach * reach;
    return away <= most;
}

// As moit_join_strokes; ranks of the layer and of what it gains are in rows `to` and `from`.
void join_layers(inout stroke_layer o, int to, stroke_layer own, int from, int count) {
    uvec2 won = own.covered & ~o.covered;
    for (int i = 0; i < count; ++i) {
        bool less = ranks[MOST_SAMPLES * from + i] < ranks[MOST_SAMPLES * to + i];
        if (!is_covered(own.covered & o.covered, i) || !less) continue;
        if (i < 32) won.x |= 1u << i;
        else won.y |= 1u << (i - 32);
    }
    int before = bits_of(o.covered), lost = bits_of(o.covered & won), total = bits_of(own.covered);
    precise double kept = lost > 0 ? double(before - lost) / double(before) : 1.0lf;
    precise double gained = double(bits_of(won)) / double(total);
    precise double sum = o.depth * kept + own.depth * gained;
    o.depth = sum;
    sum = o.alpha * kept + own.alpha * gained;
    o.alpha = sum;
    for (int k = 0; k < 3; ++k) {
        sum = o.color[k] * kept + own.color[k] * gained;
        o.color[k] = sum;
    }
    for (int k = 0; k < MOST_LIGHTS; ++k) {
        sum = o.share[k] * kept + own.share[k] * gained;
        o.share[k] = sum;
    }
    o.covered |= own.covered;
    for (int i = 0; i < count; ++i)
        if (is_covered(won, i)) ranks[MOST_SAMPLES * to + i] = ranks[MOST_SAMPLES * from + i];
    o.near = own.near < o.near ? own.near : o.near;
    o.far = own.far > o.far ? own.far : o.far;
    o.own_near = own.own_near;
    o.own_far = own.own_far;
    o.last = own.last;
}

bool follows(int i) { // the part before it
    return i > 0 && strokes[i - 1].stroke == strokes[i].stroke
           && strokes[i - 1].place == strokes[i].place - 1;
}

// The layer of a pixel that part i begins, with all that joins it; false: it begins none. A part
// does not know what those before it have become there, so this goes back to where parts begin to
// cover the pixel, then forth, until the layer ends. A second turn finds what of a closed stroke
// the other end has, as the last part joins the layer of the first.
bool layer_of(int i, ivec2 pixel, out stroke_layer o) {
    bool begins = false;
    stroke_layer whole;
    int part = i, count = has(i, STROKE_SAMPLED) ? MOST_SAMPLES : 1;
    for (int turn = 0; turn < 2; ++turn) {
        stroke_layer layer, own;
        bool back = true, open = false, there = false;
        int first = part, at = part;
        for (int guard = 0; guard < 2 * strokes.length() + 2; ++guard) {
            bool covered = at < strokes.length() && covers(at, pixel, own);
            if (back) {
                if (at == part && !covered) break;
                if (covered) first = at;
                if (covered && follows(at)) --at;
                else {
                    back = false;
                    at = first;
                }
                continue;
            }
            bool joins = open && covered && follows(at)
                         && goes_on(layer, own.near, own.far, at, 0, pixel);
            if (at > part && !joins) break;
            if (joins) join_layers(layer, LAYER_ROW, own, OWN_ROW, count);
            else {
                layer = own;
                copy_ranks(LAYER_ROW, OWN_ROW, count);
                there = turn == 0 ? at == part : true;
            }
            if (joins && turn == 0 && at == part) {
                there = false;
                break;
            }
            open = true;
            ++at;
        }
        if (turn == 0) {
            begins = there;
            whole = layer;
            copy_ranks(WHOLE_ROW, LAYER_ROW, count);
            part = strokes[i].opens == 1 ? strokes[i].other : strokes[layer.last].other;
            // is it at one end of a closed stroke, and not at both?
            bool ends = strokes[i].opens == 1 || strokes[layer.last].closes == 1;
            if (!begins || !ends || part < 0) break;
            if (strokes[i].opens == 1 && layer.last == part) break;
        } else if (there) {
            if (strokes[i].opens == 1) {
                if (goes_on(whole, layer.own_near, layer.own_far, part, 1, pixel))
                    join_layers(whole, WHOLE_ROW, layer, LAYER_ROW, count);
            } else if (goes_on(layer, whole.own_near, whole.own_far, whole.last, 1, pixel))
                begins = false;
        }
    }
    o = whole;
    return begins;
}
