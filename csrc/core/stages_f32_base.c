#define SCALAR float
#define LANES 4
#define TABLE moit_stages_f32_base
#include "core/stages_body.h"
