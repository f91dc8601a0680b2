// The rules that power_rules.comp.glsl has stored as `number`: a ray's nodes, what rounding took from
// them, residues and pivot are 3 NODES + 1 numbers in a row.

layout(std430, binding = 0) readonly restrict buffer Rules { number rules[]; };

rule rule_of(uint ray) {
    uint at = (3u * NODES + 1u) * ray;
    rule r;
    for (int k = 0; k < NODES; ++k) {
        r.g[k] = rules[at + k];
        r.g_low[k] = rules[at + NODES + k];
        r.e[k] = rules[at + 2u * NODES + k];
    }
    r.d = rules[at + 3u * NODES];
    return r;
}
