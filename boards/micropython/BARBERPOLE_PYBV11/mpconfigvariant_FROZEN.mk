# barberpole frozen into the firmware, as DIR/micropython/BARBERPOLE_PYBV11 of `barberpole build` holds it; no ROMFS.
FROZEN_MANIFEST = $(BOARD_DIR)/manifest.py
LD_FILES := $(filter-out $(BOARD_DIR)/romfs.ld,$(LD_FILES))
CFLAGS_EXTRA += -DBARBERPOLE_FROZEN=1
