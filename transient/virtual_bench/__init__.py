"""Virtual test bench: a beam with an effect hidden in it is swept in time and measured with noise."""
