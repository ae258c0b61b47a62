"""Recovery of missing laws in random structures: how often place, law, bands and description are correct.

    python -m benchmarks.missing_law --seeds 0:20

Each seed gives a structure, a hidden law that is recovered without a catalogue, and a campaign that an independent
integrator (`transient.virtual_bench`) measures on a specimen that differs from the model:

structure    a chain of 3 to 6 masses or a beam of 4 to 6 nodes, held at one end or at both; damping 0.3 to 1.5 %; in
             40 % a line of one or two friction contacts with the ground
specimen     E 0.3 %, zeta 10 %, contacts 3 to 5 % off, each natural frequency 0.05 %
hidden       a stop on one side, play, a cubic spring of either sign, a quadratic spring, a power of 1.5 to 2.5, drag,
             or an Iwan joint of four cells; its secant stiffness at the highest level is 1 to 8 % of the modal
             stiffness at its place (less for softening and drag)
tests        4 or 5 levels over a factor of 5 to 12, 24 frequencies around the first resonance, sweep up; two repeats;
             the second-highest level held out; 1 to all places with a displacement sensor; harmonic 1, 1 and 3, or 1
             to 3; noise of 0.2 to 1 % of a reading, and a floor of 0.2 % of the largest reading at the lowest level
"""
