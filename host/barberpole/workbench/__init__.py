"""The local web page: a log, a model held against it, what is missing, and what became of each attempt.

bench.py, history.py    what is on the bench, and the path to it: plain values
lab.py                  the work: fits, pictures, suspects; pure functions of what is on the bench, with a cache
worker.py               a process of its own for the work, so that the page never waits and can always cancel
session.py              one browser window: its history, its workers
guard.py                who may talk to the server, and which files it may touch
page*.py                what is seen
"""
