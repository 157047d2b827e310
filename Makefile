CFLAGS ?= -O2 -g
BUILD  ?= build
PREFIX ?= /usr/local

packages := libfyaml libpng OpenEXR cmocka
OURS     := -std=c11 -D_GNU_SOURCE -I. -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wstrict-prototypes -Werror \
            $(shell pkg-config --cflags libfyaml libpng OpenEXR)
LIBS     := $(shell pkg-config --libs libfyaml libpng) -lOpenEXRCore-3_1 -lOpenCL -lm -lpthread

kernels := $(sort $(wildcard kernels/*.h kernels/*.cl))
sources := $(sort $(wildcard host/*.c host/*/*.c))
objects := $(sources:%.c=$(BUILD)/%.o) $(BUILD)/kernel_files.o
library := $(filter-out $(BUILD)/host/main.o,$(objects))
tests   := $(patsubst tests/%.c,$(BUILD)/tests/%,$(sort $(wildcard tests/test_*.c)))

all: $(BUILD)/glint

$(BUILD)/glint: $(objects)
	$(CC) $(CFLAGS) $(LDFLAGS) $^ $(LIBS) -o $@

$(BUILD)/kernel_files.c: $(kernels) tools/embed
	@mkdir -p $(@D)
	tools/embed $(kernels) > $@

$(BUILD)/kernel_files.o: $(BUILD)/kernel_files.c
	$(CC) $(OURS) -Wno-overlength-strings $(CFLAGS) -c $< -o $@

$(BUILD)/%.o: %.c Makefile
	@mkdir -p $(@D)
	$(CC) $(OURS) $(CFLAGS) -MMD -MP -c $< -o $@

$(BUILD)/tests/%: $(BUILD)/tests/%.o $(library)
	$(CC) $(CFLAGS) $(LDFLAGS) $^ -lcmocka $(LIBS) -o $@

test: all $(tests)
	@for test in $(tests); do echo "== $$test"; $$test || exit 1; done

clean:
	rm -rf $(BUILD)

.PHONY: all test clean
.SECONDARY:
-include $(objects:.o=.d) $(tests:=.d)
