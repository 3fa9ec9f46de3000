/* What the example asks of a machine. */
#ifndef BOARD_H
#define BOARD_H

#include <stddef.h>

/* Prints a text. */
void board_print(const char *text);

/* Ends the program; 0: well. */
void board_end(int status);

/* Keeps the block that the program baked, where the machine can. */
void board_keep(const void *block, size_t bytes);

/* A block baked elsewhere, on a boundary of 64 bytes; null: none. */
extern const void *board_block;
extern size_t board_block_size;

/* The lowest place of the stack; null where it is not known. */
extern unsigned char *board_stack;

#endif
