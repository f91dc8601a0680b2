// Both at once, for pixels of few fragments: no pass for factors.
float transmittance_of_sums(sums t, float z, float alpha) {
    return transmittance(factor(t), z, alpha);
}
