#define SCALAR double
#define LANES 2
#define VECTOR_BYTES 16
#define TABLE moit_moment_adjoints_base
#define TILE_TABLE moit_tile_adjoints_base
#include "core/adjoints/moments_body.h"
