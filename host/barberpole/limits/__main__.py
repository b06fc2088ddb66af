"""`python -m barberpole.limits` prints the table; it takes half a minute."""

from barberpole.limits.page import page

if __name__ == "__main__":
    print(page())
