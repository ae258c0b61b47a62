"""The mesh study of the paper's Table 1: ten models of the stand-alone blade, each frequency three ways."""
