// Memory as malloc and its kin give it out, filled with the bytes of NaN: to be loaded before a program
// (LD_PRELOAD), so that what reads memory that it never wrote gives other results.
#include <errno.h>
#include <stddef.h>
#include <string.h>

extern void* __libc_malloc(size_t size);
extern void* __libc_memalign(size_t alignment, size_t size);

static void* filled(void* memory, size_t size) {
    return memory ? memset(memory, 0xff, size) : memory;
}

void* malloc(size_t size) {
    return filled(__libc_malloc(size), size);
}
void* memalign(size_t alignment, size_t size) {
    return filled(__libc_memalign(alignment, size), size);
}
void* aligned_alloc(size_t alignment, size_t size) {
    return memalign(alignment, size);
}
int posix_memalign(void** out, size_t alignment, size_t size) {
    *out = memalign(alignment, size);
    return *out ? 0 : ENOMEM;
}
