#pragma once

/// The 113-bit float of reference solutions: GCC's and Clang's __float128 with libquadmath.
/// libquadmath's functions are declared here because Clang does not find GCC's <quadmath.h>.
namespace porthos::phs {

__extension__ typedef __float128 Quad;

extern "C" {
Quad sinq(Quad);
Quad cosq(Quad);
void sincosq(Quad, Quad*, Quad*);
Quad sqrtq(Quad);
Quad fabsq(Quad);
Quad expq(Quad);
Quad logq(Quad);
Quad tanhq(Quad);
Quad powq(Quad, Quad);
Quad strtoflt128(const char*, char**);
int quadmath_snprintf(char*, unsigned long, const char*, ...);
}

}  // namespace porthos::phs
