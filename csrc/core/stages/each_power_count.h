/* Includes TEXT, a kernel of power moments, once for each count of nodes, of which there may be
 * one. */
#define NODES 1
#include TEXT
#undef NODES
#include "core/stages/each_count.h"
