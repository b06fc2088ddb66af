# main.py: runs when the board starts. All it does is in bp_main; a board without it falls through to the REPL.
try:
    import bp_main
except (ImportError, ValueError) as error:  # a module is missing, or made for another version of MicroPython
    print("barberpole is not complete on this board:", error)
else:
    bp_main.run()
