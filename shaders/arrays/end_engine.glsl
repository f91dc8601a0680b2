// Closes what arrays/begin_engine.glsl opens.
#undef absorbance
#undef factors
#undef warped
#undef WARP_LOG
#undef WARP_SCALE
#undef WARP_OFFSET
#undef pair
