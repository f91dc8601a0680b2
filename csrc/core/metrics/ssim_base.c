#define SCALAR double
#define LANES 2
#define VECTOR_BYTES 16
#define TABLE moit_ssim_base
#include "core/metrics/ssim_lines.h"
