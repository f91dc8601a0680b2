#define SCALAR float
#define LANES 4
#define VECTOR_BYTES 16
#define TABLE moit_flip_base
#include "core/metrics/flip_lines.h"
