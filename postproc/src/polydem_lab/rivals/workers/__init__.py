"""Programs that step scenes with other codes, each in the Python that has the code.

They import nothing of this package: the file of a worker is called as a script, beside `worker.py`.
"""
