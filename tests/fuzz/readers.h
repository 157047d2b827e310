// Declares libFuzzer's entry points of tests/fuzz/readers.c.
#pragma once

#include <stddef.h>
#include <stdint.h>

// Chooses the reader that GLINT_FUZZ names.
int LLVMFuzzerInitialize(int *argument_count, char ***arguments);
// Lets the reader read the bytes. Ends the process if the reader relies on data that is not there.
int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t size);
