"""Sparse symmetric matrices: factorisations, products and block Lanczos."""
