// What kits use of Metal's standard library, in C++: so that their texts compile, and run on a CPU.
#include <cmath>
#include <cstdint>
#include <cstring>

typedef unsigned int uint;
#define constant static const

#define VECTORS(T)                                                                                 \
    typedef T T##2 __attribute__((ext_vector_type(2)));                                            \
    typedef T T##3 __attribute__((ext_vector_type(3)));                                            \
    typedef T T##4 __attribute__((ext_vector_type(4)));                                            \
    static inline T##2 made2(T x) { return T##2{x, x}; }                                           \
    static inline T##2 made2(T x, T y) { return T##2{x, y}; }                                      \
    static inline T##3 made3(T x) { return T##3{x, x, x}; }                                        \
    static inline T##3 made3(T x, T y, T z) { return T##3{x, y, z}; }                              \
    static inline T##4 made4(T x) { return T##4{x, x, x, x}; }                                     \
    static inline T##4 made4(T x, T y, T z, T w) { return T##4{x, y, z, w}; }                      \
    static inline T##4 made4(T##2 a, T##2 b) { return T##4{a.x, a.y, b.x, b.y}; }                  \
    static inline T##4 made4(T##2 a, T z, T w) { return T##4{a.x, a.y, z, w}; }                    \
    static inline T##4 made4(T##3 a, T w) { return T##4{a.x, a.y, a.z, w}; }
VECTORS(float)
VECTORS(uint)
VECTORS(int)

// a vector is made by a call of its name
#define float2(...) made2(__VA_ARGS__)
#define float3(...) made3(__VA_ARGS__)
#define float4(...) made4(__VA_ARGS__)

template <class T> static inline T min(T a, T b) { return b < a ? b : a; }
template <class T> static inline T max(T a, T b) { return a < b ? b : a; }
template <class T> static inline T clamp(T x, T a, T b) { return min(max(x, a), b); }
static inline float3 max(float3 a, float3 b) {
    return float3{max(a.x, b.x), max(a.y, b.y), max(a.z, b.z)};
}
template <class T> static inline T mix(T a, T b, float t) { return a + (b - a) * t; }
static inline float rsqrt(float x) { return 1 / std::sqrt(x); }
static inline float fract(float x) { return x - std::floor(x); }
// clang's overloads for float
using std::abs, std::acos, std::atan, std::atan2, std::cos, std::exp, std::exp2, std::floor, std::fma,
    std::log, std::log2, std::pow, std::round, std::sin, std::sqrt, std::trunc;
static inline float sign(float x) { return (x > 0) - (x < 0); }
template <class T> static inline T select(T a, T b, bool c) { return c ? b : a; }
template <class To, class From> static inline To as_type(From x) {
    To o;
    static_assert(sizeof o == sizeof x);
    memcpy(&o, &x, sizeof o);
    return o;
}

template <class T> struct texture2d {
    const float4 *texels;
    uint width;
    float4 read(uint2 at) const { return texels[at.y * width + at.x]; }
};
