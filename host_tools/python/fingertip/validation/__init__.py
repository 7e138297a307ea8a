"""`fingertip validate`: a pad's report card, from presses of one weight at the marks of a printed template.

protocol (the steps), placements (presses in a stream of frames), measure (what each step measured), walk (leads a user), marks_fit (what
the presses state of the sensors), assess (figures and findings), card and template (pages), command (options).
"""
