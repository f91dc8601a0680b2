#define SCALAR double
#define LANES 2
#define VECTOR_BYTES 16
#define RULES
#define TABLE moit_stages_f64_base
#include "core/stages/body.h"
