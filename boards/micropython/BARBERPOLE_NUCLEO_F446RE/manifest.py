# What the variant FROZEN freezes: the stock board's modules, then barberpole's as `barberpole build` wrote them.
# In the repository there are none beside it: take the copy of this folder that a build holds.
include("$(BOARD_DIR)/../../manifest.py")
