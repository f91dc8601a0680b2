#define SCALAR double
#define LANES 2
#define VECTOR_BYTES 16
#define TABLE moit_power_adjoints_base
#include "core/adjoints/power_body.h"
