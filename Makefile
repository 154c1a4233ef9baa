# jostle: GNU make, out of tree in $(BUILD). `make help` lists the targets.
MAKEFLAGS += --no-builtin-rules
.SUFFIXES:
.DELETE_ON_ERROR:

CC       ?= gcc
ifeq ($(origin CC),default)
CC       := gcc
endif
CXX      ?= g++
ifeq ($(origin CXX),default)
CXX      := g++
endif
AR       ?= ar
PREFIX   ?= /usr/local
DESTDIR  ?=
OPT      ?= -O2
SANITIZE ?=
V        ?= 0
BUILD    ?= build$(if $(SANITIZE),/sanitize-$(subst $(comma),-,$(SANITIZE)))
comma    := ,

VERSION  := $(shell sed -n 's/^\#define JSL_VERSION_TEXT "\(.*\)"/\1/p' include/jostle/base.h)
SOMAJOR  := $(firstword $(subst ., ,$(VERSION)))
GIT      := $(shell git describe --always --dirty 2>/dev/null || echo unknown)

ifeq ($(V),0)
Q    := @
say   = @printf '  %-6s %s\n' '$(1)' '$(2)'
else
Q    :=
say   = @:
endif

# -- Flags ------------------------------------------------------------------------------------------
WARN     := -Wall -Wextra -Wpedantic -Wconversion -Wshadow -Wstrict-prototypes -Wmissing-prototypes -Werror
# No contraction, no fast-math: the same bits from every build. errno and traps of libm are not used.
FLOAT    := -ffp-contract=off -fno-math-errno -fno-trapping-math
SAN      := $(if $(SANITIZE),-fsanitize=$(SANITIZE) -fno-omit-frame-pointer -fno-sanitize-recover=all)
CSTD     := -std=c17 -D_POSIX_C_SOURCE=200809L -D_DEFAULT_SOURCE
CBASE     = $(CSTD) $(WARN) $(FLOAT) -g -ffile-prefix-map=$(CURDIR)=. $(SAN) -fPIC -fvisibility=hidden -ffunction-sections -fdata-sections -pthread \
            -Iinclude -Isrc -MMD -MP $(CFLAGS)
LDBASE    = $(SAN) -pthread -Wl,--gc-sections $(LDFLAGS)

ARCH     := $(shell $(CC) -dumpmachine | cut -d- -f1)
ISA_scalar := 1
ISA_sse    := 2 -msse4.1
ISA_avx2   := 3 -mavx2
ISA_avx512 := 4 -mavx512f -mavx512vl -mavx512dq -mavx512bw -mprefer-vector-width=512
ISAS     := scalar $(if $(filter x86_64,$(ARCH)),sse avx2 avx512)

pkgcflags = $(shell pkg-config --cflags $(1) 2>/dev/null)
pkglibs   = $(shell pkg-config --libs $(1) 2>/dev/null)

# -- Libraries ----------------------------------------------------------------------------------------
ROOMS_core   := base math ecs geometry particle flock rigid world
ROOMS_scene  := scene
ROOMS_lcm    := telemetry
ROOMS_render := render
ROOMS_oracle := oracle
LIBS         := core scene lcm render oracle
NAME_core    := jostle
NAME_scene   := jostle-scene
NAME_lcm     := jostle-lcm
NAME_render  := jostle-render
NAME_oracle  := jostle-oracle
PKG_scene    := jansson
PKG_lcm      :=
PKG_render   := osmesa libpng
PKG_oracle   := ode
EXT_core     := -lm
EXT_scene    := $(call pkglibs,jansson)
# Not by pkg-config: lcm.pc asks for glib-2.0.pc, which Debian's liblcm-dev does not depend on.
EXT_lcm      := -llcm
EXT_render   := $(call pkglibs,osmesa libpng)
EXT_oracle   := $(call pkglibs,ode) -lbox2d -lstdc++
NEEDS_scene  := jostle
NEEDS_lcm    := jostle
NEEDS_render := jostle
NEEDS_oracle := jostle
PKGC         := $(call pkgcflags,jansson osmesa libpng ode)

# A library is built when its room has sources.
sources  = $(sort $(foreach r,$(ROOMS_$(1)),$(wildcard src/$(r)/*.c)))
cxxsrc   = $(sort $(foreach r,$(ROOMS_$(1)),$(wildcard src/$(r)/*.cpp)))
LIBS    := $(foreach l,$(LIBS),$(if $(call sources,$(l)),$(l)))

PRECS      := f32 f64
DEF_f32    :=
DEF_f64    := -DJSL_DOUBLE
SUF_f32    :=
SUF_f64    := -f64

kernel_objs = $(foreach s,$(filter %_kernel.c,$(2)),$(foreach i,$(ISAS),$(BUILD)/obj/$(1)/$(s:.c=.$(i).o)))
plain_objs  = $(patsubst %.c,$(BUILD)/obj/$(1)/%.o,$(filter-out %_kernel.c,$(2)))
objs        = $(call plain_objs,$(1),$(call sources,$(2))) $(call kernel_objs,$(1),$(call sources,$(2))) \
              $(patsubst %.cpp,$(BUILD)/obj/$(1)/%.o,$(call cxxsrc,$(2)))
static_lib  = $(BUILD)/lib/lib$(NAME_$(2))$(SUF_$(1)).a
shared_lib  = $(BUILD)/lib/lib$(NAME_$(2))$(SUF_$(1)).so

TOOL_SRC   := $(sort $(wildcard tools/jostle/*.c))
TOOLS      := $(if $(TOOL_SRC),$(foreach p,$(PRECS),$(BUILD)/bin/jostle$(SUF_$(p))))
STATIC     := $(foreach p,$(PRECS),$(foreach l,$(LIBS),$(call static_lib,$(p),$(l))))
SHARED     := $(foreach p,$(PRECS),$(foreach l,$(LIBS),$(call shared_lib,$(p),$(l))))
PCFILES    := $(foreach p,$(PRECS),$(foreach l,$(LIBS),$(BUILD)/lib/pkgconfig/$(NAME_$(l))$(SUF_$(p)).pc))
LINK_ORDER := $(foreach l,oracle render lcm scene core,$(filter $(l),$(LIBS)))
link_libs   = $(foreach l,$(LINK_ORDER),$(call static_lib,$(1),$(l)))
link_ext    = $(foreach l,$(LINK_ORDER),$(EXT_$(l)))

.PHONY: all libs tools examples demo test test-all bench install uninstall clean help format format-check setup checks
all: libs tools ## build the libraries (static and shared, float and double) and the command
libs: $(STATIC) $(SHARED) $(PCFILES)
tools: $(TOOLS)

# -- Rules ----------------------------------------------------------------------------------------------
define precision_rules
$(BUILD)/obj/$(1)/%.o: %.c
	$$(call say,CC,$$< $(1))
	@mkdir -p $$(@D)
	$$(Q)$$(CC) $$(CBASE) $$(OPT) $$(PKGC) $(DEF_$(1)) -DJSL_GIT='"$$(GIT)"' -c $$< -o $$@
$(BUILD)/obj/$(1)/%.o: %.cpp
	$$(call say,CXX,$$< $(1))
	@mkdir -p $$(@D)
	$$(Q)$$(CXX) -std=c++17 -Wall -Wextra $$(FLOAT) -g $$(SAN) -fPIC -fvisibility=hidden -fno-exceptions -fno-rtti -Iinclude -Isrc -MMD -MP $$(OPT) $(DEF_$(1)) -c $$< -o $$@
$(foreach i,$(ISAS),
$(BUILD)/obj/$(1)/%_kernel.$(i).o: %_kernel.c
	$$(call say,CC,$$< $(1) $(i))
	@mkdir -p $$(@D)
	$$(Q)$$(CC) $$(CBASE) $$(if $$(SANITIZE),-O1,$$(if $$(filter -O2,$$(OPT)),-O3,$$(OPT))) $(DEF_$(1)) -DJSL_KERNEL_ISA=$$(ISA_$(i)) -c $$< -o $$@
)
endef
$(foreach p,$(PRECS),$(eval $(call precision_rules,$(p))))

define library_rules
$(call static_lib,$(1),$(2)): $(call objs,$(1),$(2))
	$$(call say,AR,$$@)
	@mkdir -p $$(@D)
	$$(Q)rm -f $$@ && $$(AR) rcs $$@ $$^
# A satellite uses internal functions of the core that libjostle.so does not export: its own copies of those come from
# the archive, hidden. What libjostle.so exports is taken from there.
$(call shared_lib,$(1),$(2)): $(call objs,$(1),$(2)) $$(foreach n,$$(NEEDS_$(2)),$(BUILD)/lib/lib$$(n)$(SUF_$(1)).so) \
    $$(if $$(NEEDS_$(2)),$(call static_lib,$(1),core))
	$$(call say,LD,$$@)
	@mkdir -p $$(@D)
	$$(Q)$$(CC) -shared $$(LDBASE) -Wl,-soname,lib$(NAME_$(2))$(SUF_$(1)).so.$(SOMAJOR) $$(filter %.o,$$^) \
	    -L$(BUILD)/lib $$(foreach n,$$(NEEDS_$(2)),-l$$(n)$(SUF_$(1))) $$(filter %.a,$$^) -Wl,--exclude-libs,ALL \
	    $$(if $$(SANITIZE),,$$(if $$(NEEDS_$(2)),-Wl$$(comma)-z$$(comma)defs)) $$(EXT_$(2)) -lm -o $$@
	$$(Q)ln -sf $$(@F) $$@.$(SOMAJOR)
$(BUILD)/lib/pkgconfig/$(NAME_$(2))$(SUF_$(1)).pc: Makefile include/jostle/base.h
	@mkdir -p $$(@D)
	@printf '%s\n' 'prefix=$(PREFIX)' 'includedir=$$$${prefix}/include' 'libdir=$$$${prefix}/lib' '' \
	    'Name: $(NAME_$(2))$(SUF_$(1))' 'Description: jostle animates particles, flocks and rigid bodies ($(1))' \
	    'Version: $(VERSION)' \
	    'Requires: $$(foreach n,$$(NEEDS_$(2)),$$(n)$(SUF_$(1)))' 'Requires.private: $$(PKG_$(2))' \
	    'Cflags: -I$$$${includedir} $(DEF_$(1))' 'Libs: -L$$$${libdir} -l$(NAME_$(2))$(SUF_$(1))' \
	    'Libs.private: $$(EXT_$(2)) -lm -pthread' > $$@
endef
$(foreach p,$(PRECS),$(foreach l,$(LIBS),$(eval $(call library_rules,$(p),$(l)))))

define tool_rules
$(BUILD)/bin/jostle$(SUF_$(1)): $(patsubst %.c,$(BUILD)/obj/$(1)/%.o,$(TOOL_SRC)) $$(call link_libs,$(1))
	$$(call say,LD,$$@)
	@mkdir -p $$(@D)
	$$(Q)$$(CC) $$(LDBASE) $$^ $$(link_ext) -lm -o $$@
endef
$(foreach p,$(PRECS),$(eval $(call tool_rules,$(p))))

# -- LCM: the schema's text inside the library; lcm-gen's own code as an oracle, in tests only ------------------
$(BUILD)/gen/jostle_lcm_text.h: lcmtypes/jostle.lcm
	@mkdir -p $(@D)
	$(Q)od -An -v -tx1 $< | sed 's/ \(..\)/0x\1,/g' > $@
$(foreach p,$(PRECS),$(BUILD)/obj/$(p)/src/telemetry/schema.o): $(BUILD)/gen/jostle_lcm_text.h
$(foreach p,$(PRECS),$(BUILD)/obj/$(p)/src/telemetry/schema.o): CBASE += -I$(BUILD)/gen

LCMGEN   := $(BUILD)/lcmgen/liblcmgen.a
$(LCMGEN): lcmtypes/jostle.lcm
	$(call say,LCMGEN,$<)
	@rm -rf $(@D) && mkdir -p $(@D)
	$(Q)lcm-gen -c --c-cpath $(@D) --c-hpath $(@D) $<
	$(Q)cd $(@D) && $(CC) -O2 -w -fPIC -c jostle_*.c && $(AR) rcs $(@F) jostle_*.o
INTEROP  := $(patsubst %.c,%,$(filter tests/interop/%,$(sort $(wildcard tests/*/test_*.c))))
$(foreach p,$(PRECS),$(foreach t,$(INTEROP),$(BUILD)/obj/$(p)/$(t).o)): $(LCMGEN)
$(foreach p,$(PRECS),$(foreach t,$(INTEROP),$(BUILD)/obj/$(p)/$(t).o)): CBASE += -isystem $(BUILD)/lcmgen
$(foreach p,$(PRECS),$(foreach t,$(INTEROP:tests/%=%),$(BUILD)/test/$(p)/$(t))): $(LCMGEN)

# -- Tests: tests/<kind>/test_<module>.c, each a cmocka program in both precisions ------------------------
TEST_SRC  := $(sort $(wildcard tests/*/test_*.c tests/*/tool_*.c)) # tool_*: programs that script tests use
TEST_HELP := $(wildcard tests/helper/*.c)
test_bin   = $(patsubst tests/%.c,$(BUILD)/test/$(1)/%,$(TEST_SRC))
TEST_BINS := $(foreach p,$(PRECS),$(call test_bin,$(p)))
define test_rules
$(BUILD)/test/$(1)/%: $(BUILD)/obj/$(1)/tests/%.o $(patsubst %.c,$(BUILD)/obj/$(1)/%.o,$(TEST_HELP)) $$(call link_libs,$(1))
	$$(call say,LD,$$@)
	@mkdir -p $$(@D)
	$$(Q)$$(CC) $$(LDBASE) $$(filter %.o,$$^) $$(filter %.a,$$^) $$(link_ext) -lcmocka -lm -o $$@
endef
$(foreach p,$(PRECS),$(eval $(call test_rules,$(p))))
$(BUILD)/obj/%/tests/helper/helper.o $(BUILD)/obj/f32/tests/% $(BUILD)/obj/f64/tests/%: CBASE += -Itests/helper
test-bins: $(TEST_BINS)
.SECONDARY:

setup: ## install missing Debian packages
	@tools/setup.sh

checks: libs ## floors, sizes, globals
	@tools/check_floors.sh
	@tools/check_sizes.sh
	@tools/check_globals.sh $(BUILD)/lib/libjostle.a $(BUILD)/lib/libjostle-f64.a
	@tools/check_fma.sh $(BUILD)/lib/libjostle.a $(BUILD)/lib/libjostle-f64.a

test: setup ## install what is missing, build, run every test (10 minutes on 2 cores)
	@$(MAKE) --no-print-directory -j$$(nproc) all test-bins examples
	@BUILD=$(BUILD) SANITIZE=$(SANITIZE) tools/run_tests.sh

test-all: setup ## make test, then sanitizers, clang, valgrind, -O0 and -O3
	@tools/test_all.sh

demo: setup ## simulate the showcase, log it, play it back into pictures and a video
	@$(MAKE) --no-print-directory -j$$(nproc) tools
	@BUILD=$(BUILD) tools/demo.sh

bench: tools ## time the kernels and print one JSON object a line
	@$(BUILD)/bin/jostle bench all --json

# Float, against the static libraries; as a user would compile them, but with our warnings.
EXAMPLES  := $(patsubst tools/examples/%.c,$(BUILD)/examples/%,$(sort $(wildcard tools/examples/*.c)))
$(BUILD)/examples/%: $(BUILD)/obj/f32/tools/examples/%.o $(call link_libs,f32)
	$(call say,LD,$@)
	@mkdir -p $(@D)
	$(Q)$(CC) $(LDBASE) $^ $(link_ext) -lm -o $@
examples: $(EXAMPLES) ## build tools/examples/*.c into build/examples

format: ## rewrite the sources with clang-format
	@clang-format-16 -i $$(git ls-files '*.c' '*.h' '*.cpp')
format-check: ## fail when a source is not formatted
	@if command -v clang-format-16 >/dev/null; then clang-format-16 --dry-run -Werror $$(git ls-files '*.c' '*.h' '*.cpp'); \
	else echo 'format-check: clang-format-16 is not installed (apt-get install clang-format-16); skipped'; fi

install: all ## install libraries, headers, .pc files, command and LCM types under $(DESTDIR)$(PREFIX)
	@install -d $(DESTDIR)$(PREFIX)/include/jostle $(DESTDIR)$(PREFIX)/lib/pkgconfig $(DESTDIR)$(PREFIX)/bin $(DESTDIR)$(PREFIX)/share/jostle
	@install -m 644 include/jostle/*.h $(DESTDIR)$(PREFIX)/include/jostle/
	@install -m 644 $(STATIC) $(DESTDIR)$(PREFIX)/lib/
	@for so in $(SHARED); do n=$$(basename $$so); install -m 755 $$so $(DESTDIR)$(PREFIX)/lib/$$n.$(VERSION); \
	    ln -sf $$n.$(VERSION) $(DESTDIR)$(PREFIX)/lib/$$n.$(SOMAJOR); ln -sf $$n.$(SOMAJOR) $(DESTDIR)$(PREFIX)/lib/$$n; done
	@for pc in $(PCFILES); do sed 's|^prefix=.*|prefix=$(PREFIX)|' $$pc > $(DESTDIR)$(PREFIX)/lib/pkgconfig/$$(basename $$pc); done
	@install -m 755 $(TOOLS) $(DESTDIR)$(PREFIX)/bin/
	@install -m 644 lcmtypes/*.lcm $(DESTDIR)$(PREFIX)/share/jostle/
	@echo "installed jostle $(VERSION) under $(DESTDIR)$(PREFIX)"

uninstall: ## remove what install put there
	@rm -rf $(DESTDIR)$(PREFIX)/include/jostle $(DESTDIR)$(PREFIX)/share/jostle
	@rm -f $(DESTDIR)$(PREFIX)/bin/jostle $(DESTDIR)$(PREFIX)/bin/jostle-f64
	@for l in $(foreach p,$(PRECS),$(foreach l,$(LIBS),$(NAME_$(l))$(SUF_$(p)))); do \
	    rm -f $(DESTDIR)$(PREFIX)/lib/lib$$l.a $(DESTDIR)$(PREFIX)/lib/lib$$l.so* $(DESTDIR)$(PREFIX)/lib/pkgconfig/$$l.pc; done

clean: ## remove the build folder
	@rm -rf build

help: ## this list
	@echo 'targets:'; sed -n 's/^\([a-z-]*\):[^#]*## \(.*\)/  \1|\2/p' Makefile | awk -F'|' '{printf "%-14s %s\n", $$1, $$2}'
	@echo 'variables: V=1 (show commands)  SANITIZE=address,undefined  CC=clang-16  OPT=-O3  PREFIX=  DESTDIR=  BUILD='

-include $(shell find $(BUILD)/obj -name '*.d' 2>/dev/null)
