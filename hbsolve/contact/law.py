"""What the harmonic balance asks of a contact law."""

from typing import Protocol

from hbsolve.fourier import Coefficients


class ContactLaw(Protocol):
    """The force that a joint takes from the structure when the structure moves periodically."""

    def force(self, coefficients: Coefficients, angular_frequency: float) -> Coefficients:
        """Fourier coefficients of f_c in M q'' + C q' + K q + f_c = f_ext, in the convention of `hbsolve.fourier`.

        Parameters
        ----------
        coefficients
            Of the whole structure's displacement, shape (n_harmonic, r) [m].
        angular_frequency
            Omega [rad/s].

        Returns
        -------
        Shape (n_harmonic, r) [N]: positive where the joint resists a positive displacement.
        """
        ...
