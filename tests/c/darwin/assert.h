/* What macOS has in headers of these names, as far as the core may ask for it: tests/portable.py
 * compiles the core against these, so that what is Linux's alone is unknown. */
#define assert(e) ((void)sizeof(e))
