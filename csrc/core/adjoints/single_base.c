#define SCALAR float
#define LANES 4
#define VECTOR_BYTES 16
#define TABLE moit_single_adjoints_base
#include "core/adjoints/single_body.h"
