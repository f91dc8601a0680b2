/* Includes TEXT, a kernel of moments, once for each count of nodes (kernels/README.md, NODES). */
#define NODES 2
#include TEXT
#undef NODES
#define NODES 3
#include TEXT
#undef NODES
#define NODES 4
#include TEXT
#undef NODES
#undef TEXT
