/*
 * Machines without operating system, and Linux on x86-64 without a C library: the functions that compilers take for
 * granted, and a console. The baked block stands in read-only memory.
 */
#include "board.h"

#include <stdint.h>

extern const unsigned char block_start[], block_end[];
const void *board_block = block_start;
size_t board_block_size;
unsigned char *board_stack;
int main(void);
void start(void);

void *memcpy(void *restrict to, const void *restrict from, size_t count)
{
    unsigned char *t = to;
    const unsigned char *f = from;
    while (count-- != 0) {
        *t++ = *f++;
    }
    return to;
}

void *memmove(void *to, const void *from, size_t count)
{
    unsigned char *t = to;
    const unsigned char *f = from;
    if (t < f) {
        return memcpy(to, from, count);
    }
    while (count-- != 0) {
        t[count] = f[count];
    }
    return to;
}

void *memset(void *to, int value, size_t count)
{
    unsigned char *t = to;
    while (count-- != 0) {
        *t++ = (unsigned char)value;
    }
    return to;
}

void board_keep(const void *block, size_t bytes)
{
    (void)block;
    (void)bytes;
}

#if defined(__x86_64__)

static long call(long number, long a, long b, long c)
{
    long result;
    __asm__ volatile("syscall" : "=a"(result) : "a"(number), "D"(a), "S"(b), "d"(c) : "rcx", "r11", "memory");
    return result;
}

void board_print(const char *text)
{
    size_t length = 0;
    while (text[length] != 0) {
        ++length;
    }
    call(1, 1, (long)text, (long)length);
}

void board_end(int status)
{
    for (;;) {
        call(231, status, 0, 0);
    }
}

__asm__(".globl _start\n_start: and $-16, %rsp\ncall start\n");

#else /* semihosting */

static uintptr_t call(uintptr_t operation, const void *parameter)
{
#if defined(__aarch64__)
    register uintptr_t r0 __asm__("x0") = operation;
    register const void *r1 __asm__("x1") = parameter;
    __asm__ volatile("hlt #0xf000" : "+r"(r0) : "r"(r1) : "memory");
#else
    register uintptr_t r0 __asm__("r0") = operation;
    register const void *r1 __asm__("r1") = parameter;
    __asm__ volatile("bkpt #0xab" : "+r"(r0) : "r"(r1) : "memory");
#endif
    return r0;
}

void board_print(const char *text) { call(0x04, text); }

void board_end(int status)
{
    const uintptr_t block[2] = {0x20026, (uintptr_t)status};
    for (;;) {
        call(0x20, block);
    }
}

#if defined(__aarch64__)
__asm__(".section .vectors, \"ax\"\n.globl _start\n_start:\n"
        "mov x0, #(3 << 20)\nmsr cpacr_el1, x0\nisb\n" /* floating point on */
        "ldr x0, =stack_top\nmov sp, x0\nbl start\n.text\n");
#else
extern unsigned char stack_top[];
extern const uint32_t data_load[];
extern uint32_t data_start[], data_end[];

static void reset(void)
{
    const uint32_t *from = data_load;
    uint32_t *to = data_start;
    *(volatile uint32_t *)0xE000ED88 |= 0xFU << 20; /* floating point on */
    __asm__ volatile("dsb\nisb");
    while (to != data_end) {
        *to++ = *from++;
    }
    start();
}

static void fault(void)
{
    board_print("fault\n");
    board_end(2);
}

__attribute__((section(".vectors"), used)) static const void *const vectors[] = {
    stack_top, (const void *)reset, (const void *)fault, (const void *)fault,
    (const void *)fault, (const void *)fault, (const void *)fault};
#endif

#endif

void start(void)
{
    board_block_size = (size_t)(block_end - block_start);
#if !defined(__x86_64__)
    extern unsigned char stack_low[];
    board_stack = stack_low;
#endif
    main();
}

__asm__(".section .rodata.block, \"a\"\n.balign 64\n.globl block_start, block_end\nblock_start:\n"
        ".incbin \"block.bin\"\nblock_end:\n.text\n");
