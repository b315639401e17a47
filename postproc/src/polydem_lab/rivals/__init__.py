"""Speed against error beside other codes: problems with known rigid answers, solved by polydem and by its rivals.

The verb is `./polydem rivals`; the page postproc/verdicts/rivals says what is compared. A new problem is a row of
`problems.PROBLEMS`, a new code a module of `codes` and a row of `codes.CODES`.
"""
