/* The families of moments: which a technique has, and what general questions about it come to. */
#include "core/techniques/table.h"

const moit_moment_family *moit_family_of(const moit_technique *technique) {
    return moit_technique_rows[technique->kind]->moments;
}

int moit_moment_numbers(const moit_technique *technique) {
    const moit_moment_family *family = moit_family_of(technique);
    int numbers = family ? family->numbers(technique->count) : 0;
    return family == &moit_mt_moments && technique->transparency.passes == 2 ? 2 * numbers + 1
                                                                             : numbers;
}

double moit_default_bias(const moit_technique *technique, moit_precision precision) {
    return moit_family_of(technique)->constants(technique)->default_bias[precision];
}

double moit_published_bias(const moit_technique *technique) {
    return moit_family_of(technique)->constants(technique)->published_bias;
}
