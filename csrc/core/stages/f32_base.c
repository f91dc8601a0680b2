#define SCALAR float
#define LANES 4
#define VECTOR_BYTES 16
#define TABLE moit_stages_f32_base
#include "core/stages/body.h"
