// What kits use of Metal's standard library, in C++: so that their texts compile, and run on a CPU.
#include <cmath>
#include <cstdint>
#include <cstring>

typedef unsigned int uint;
#define constant static const
#define thread

#define VECTORS(T)                                                                                 \
    typedef T T##2 __attribute__((ext_vector_type(2)));                                            \
    typedef T T##3 __attribute__((ext_vector_type(3)));                                            \
    typedef T T##4 __attribute__((ext_vector_type(4)));
VECTORS(float)
VECTORS(uint)
VECTORS(int)

// A vector is made by a call of its name, of numbers and shorter vectors, or of one number.
struct parts {
    float x[8];
    int n = 0;
    void put(float a) { x[n++] = a; }
    void put(float2 a) { put(a.x), put(a.y); }
    void put(float3 a) { put(a.xy), put(a.z); }
    void put(float4 a) { put(a.xy), put(a.zw); }
};
template <class T, int count, class... Given> static inline T vector_made(Given... given) {
    parts all;
    (all.put(given), ...);
    T o;
    for (int i = 0; i < count; ++i) o[i] = all.x[all.n == 1 ? 0 : i];
    return o;
}
typedef float2 vector2;
typedef float3 vector3;
typedef float4 vector4;
#define float2(...) vector_made<vector2, 2>(__VA_ARGS__)
#define float3(...) vector_made<vector3, 3>(__VA_ARGS__)
#define float4(...) vector_made<vector4, 4>(__VA_ARGS__)

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
