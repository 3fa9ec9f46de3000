/* The workstation as a board: prints to standard output, keeps the block in the file that BLIK_BLOCK names. */
#include "board.h"

#include <stdio.h>
#include <stdlib.h>

const void *board_block = NULL;
size_t board_block_size = 0;
unsigned char *board_stack = NULL;

void board_print(const char *text) { fputs(text, stdout); }

void board_end(int status) { exit(status); }

void board_keep(const void *block, size_t bytes)
{
    const char *path = getenv("BLIK_BLOCK");
    FILE *file = path != NULL ? fopen(path, "wb") : NULL;
    if (path != NULL && (file == NULL || fwrite(block, 1, bytes, file) != bytes || fclose(file) != 0)) {
        board_print("the block cannot be written\n");
        exit(1);
    }
}
