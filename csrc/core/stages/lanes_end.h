/* The end of what lanes.h has begun. */
#if defined(TARGET) && defined(__clang__)
#pragma clang attribute pop
#endif
