/* What the library was made of, and what the processor can do. */

#include <stdint.h>

#include "exported.h"

/* The SHA-256 of the sources, hexadecimal: Python refuses a library that is older than they are. */
EXPORTED const char *made_of(void) { return MADE_OF; }

#if defined(__x86_64__)
#include <cpuid.h>

/* Whether AVX2 and FMA are there, and the system keeps their registers. */
EXPORTED int32_t has_avx2(void) {
    unsigned a, b, c, d;
    if (!__get_cpuid(1, &a, &b, &c, &d) || !(c & bit_FMA) || !(c & bit_OSXSAVE))
        return 0;
    __asm__("xgetbv" : "=a"(a), "=d"(d) : "c"(0));
    return (a & 6) == 6 && __get_cpuid_count(7, 0, &a, &b, &c, &d) && (b & bit_AVX2);
}
#else
EXPORTED int32_t has_avx2(void) { return 0; }
#endif
