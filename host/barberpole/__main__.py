from barberpole.cli import main

main()
