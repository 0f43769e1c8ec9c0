"""The compiled fit of the image of a checkerboard's corner.

Around a corner the image is taken as ``a + b u v``, see `image_model`. Whatever is wrong with this model is alike on
opposite sides of the corner (another psf, neighbouring squares, a tone curve) and so does not move it, as long as the
window is symmetric about the corner: therefore the window follows the corner in every step, and ends in a soft ramp
instead of at whole pixels, see `window`. `normal_matrix` has the algebra of a step, `fitting` the steps, `examination`
what a fit tells beside the place.

The form of the code is ruled by the compiler. One flat buffer with constant offsets, because LLVM vectorises a loop
only where it can prove that what is written is not read again, and gives up beyond a hundred pairs of columns. No
slices, because each costs a tenth of a second of compilation. Lengths are asked for, though constant, lest loops be
unrolled. Importing any of the modules but `layout` imports Numba: see `opencsp_calib.compiled`.
"""
