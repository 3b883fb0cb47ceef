/* bcryptprimitives.dll, which the standard library of Rust imports and Wine 8 lacks. Only this function of it is used. */
#include <stddef.h>
__declspec(dllimport) unsigned char __stdcall SystemFunction036(void *, unsigned long);
__declspec(dllexport) int __stdcall ProcessPrng(unsigned char *p, size_t n) { return SystemFunction036(p, (unsigned long)n); }
