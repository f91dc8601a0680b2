// A network of fully connected layers, its weights as data: what a multilayer perceptron needs.
//
// Weights lie layer by layer, in a layer output by output: a weight for each input, then what the
// output begins with (its bias). An `address` says where those of a layer begin: in C where in
// memory, in GLSL which place of the buffer `network`; the next layer begins (inputs + 1) outputs
// further on. Counts are known when compiling, up to WIDEST, which the includer defines.

STRUCT(values) { number x[WIDEST]; };

// What the outputs of a layer begin with.
FN values layer_bias(address weights, int inputs, int outputs) {
    values sum;
    for (int j = 0; j < outputs; ++j) sum.x[j] = NETWORK_NUMBER(weights, j * (inputs + 1) + inputs);
    return sum;
}

// `sum` and what `count` of the layer's inputs, from the input `first` on, add to it. Inputs that
// many share, a pixel's fragments say, may so be added once for all.
FN values layer_sum(address weights, values sum, values from, int first, int count, int inputs,
                    int outputs) {
    for (int j = 0; j < outputs; ++j) {
        real y = sum.x[j];
        for (int k = 0; k < count; ++k) {
            real x = from.x[k];
            y = y + NETWORK_NUMBER(weights, j * (inputs + 1) + first + k) * x;
        }
        sum.x[j] = y;
    }
    return sum;
}

// The outputs of a layer.
FN values layer_outputs(address weights, values from, int inputs, int outputs) {
    return layer_sum(weights, layer_bias(weights, inputs, outputs), from, 0, inputs, inputs,
                     outputs);
}

// What goes on to the next layer: negative values do not.
FN values rectified(values sum, int count) {
    for (int j = 0; j < count; ++j) sum.x[j] = max(sum.x[j], K(0.0));
    return sum;
}

// 1 / (1 + exp(-x)), within [0, 1] for any x but NaN.
FN number sigmoid(real x) {
    real decay = exponential(clamp(-x, K(-80.0), K(80.0)));
    return 1.0 / (1.0 + decay);
}
