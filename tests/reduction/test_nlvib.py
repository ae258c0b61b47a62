"""A structure written for NLvib: its fields, the way back, and Octave's own reading and residual."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import scipy.io

from hbsolve.balance import HarmonicBalance
from hbsolve.steady_state import steady_state
from reduction.errors import ExchangeError
from reduction.jointed_system import (
    CubicSpring,
    ElasticStop,
    FrictionContact,
    JenkinsElement,
    JointedSystem,
    QuadraticDamper,
    along,
    between,
)
from reduction.nlvib import load_nlvib, save_nlvib

N = 3
M = np.diag([1.0, 2.0, 1.5])
K = 4e4 * np.array([[2.0, -1.0, 0.0], [-1.0, 2.0, -1.0], [0.0, -1.0, 1.0]])
C = 2e-4 * K
SLIDER = JenkinsElement(name="slider", direction=between(N, 2, 0), tangential_stiffness=3e4, limit_force=2.0)
STOP = ElasticStop(name="stop", direction=along(N, {1: -1.0}), stiffness=5e4, gap=1e-5)
CUBIC = CubicSpring(name="cubic", direction=between(N, 0), stiffness=2e11)
OMEGA = 120.0  # rad/s, near the first resonance: all three joints act


def system(*joints: object, **loads: object) -> JointedSystem:
    force = np.zeros((2, N), dtype=complex)
    force[1] = [1.0 - 2.0j, 0.0, 3.0]
    given = {"harmonic_force": force, **loads}
    return JointedSystem(mass=M, damping=C, stiffness=K, joints=joints, **given)  # type: ignore[arg-type]


def response(of: JointedSystem) -> np.ndarray:
    return np.asarray(steady_state(HarmonicBalance(system=of, n_harmonic=8, n_sample=256), OMEGA).coefficients)


def test_a_structure_read_back_responds_as_the_one_that_was_written(tmp_path: Path) -> None:
    whole = system(SLIDER, STOP, CUBIC)
    save_nlvib(whole, tmp_path / "s.mat")
    read = load_nlvib(tmp_path / "s.mat")
    assert [joint.name for joint in read.joints] == ["slider", "stop", "cubic"]
    want = response(whole)
    assert np.abs(want[3]).max() > 1e-2 * np.abs(want[1]).max()  # the joints are at work
    assert np.abs(response(read) - want).max() <= 1e-9 * np.abs(want).max()  # the same bits are read


def test_a_contact_without_friction_is_written_as_a_stop_that_is_closed_by_its_preload(tmp_path: Path) -> None:
    contact = FrictionContact(
        name="wall", normal=along(N, {2: 1.0}), tangents=between(N, 0), normal_stiffness=2e4,
        tangential_stiffness=1e4, friction_coefficient=0.0, preload=1.0, gap=2e-5,
    )  # fmt: skip
    save_nlvib(system(contact), tmp_path / "s.mat")
    (stop,) = load_nlvib(tmp_path / "s.mat").joints
    assert isinstance(stop, ElasticStop)
    assert stop.gap == 2e-5 - 1.0 / 2e4
    want = response(system(contact))
    assert np.abs(response(system(stop)) - want).max() <= 1e-9 * np.abs(want).max()  # Newton's tolerance


def test_the_file_has_the_fields_and_classes_that_nlvib_reads(tmp_path: Path) -> None:
    save_nlvib(system(SLIDER, STOP, CUBIC), tmp_path / "s.mat")
    (whole,) = scipy.io.loadmat(tmp_path / "s.mat")["system"].ravel()
    assert set(whole.dtype.names) == {"M", "D", "K", "Fex1", "nonlinear_elements"}
    assert whole["M"].dtype == np.float64
    assert whole["Fex1"].shape == (N, 1)
    assert whole["Fex1"].dtype == np.complex128
    cell = whole["nonlinear_elements"]
    assert cell.shape == (1, 3)
    assert cell.dtype == object
    common = {"type", "name", "islocal", "ishysteretic", "force_direction"}
    wanted = [
        ("elasticDryFriction", 1.0, {"stiffness", "friction_limit_force"}),
        ("unilateralSpring", 0.0, {"stiffness", "gap"}),
        ("cubicSpring", 0.0, {"stiffness"}),
    ]
    for element, (kind, hysteretic, numbers) in zip(cell.ravel(), wanted, strict=True):
        (fields,) = element.ravel()
        assert set(fields.dtype.names) == common | numbers
        assert fields["type"].item() == kind
        assert fields["islocal"].item() == 1.0
        assert fields["ishysteretic"].item() == hysteretic
        assert fields["force_direction"].shape == (N, 1)


#: The laws as NLvib's manual states them, on the fields that it reads; two periods settle the slider.
RESIDUAL = """
load('s.mat'); load('q.mat');
s = system; e = s.nonlinear_elements;
assert(isstruct(s) && iscell(e) && isequal(size(e), [1 3]) && isstruct(e{1}));
assert(isequal(class(s.M), 'double') && isreal(s.K) && iscomplex(s.Fex1) && iscolumn(s.Fex1));
assert(ischar(e{1}.type) && e{1}.ishysteretic == 1 && iscolumn(e{2}.force_direction));
H = rows(Q) - 1; N = 256; tau = 2*pi*(0:2*N-1)'/N; k = (0:H)';
F = zeros(size(Q));
for j = 1:numel(e)
  u = real(exp(1i*tau*k') * (Q * e{j}.force_direction)); f = zeros(size(u)); w = 0;
  switch e{j}.type
    case 'cubicSpring'
      f = e{j}.stiffness * u.^3;
    case 'unilateralSpring'
      f = e{j}.stiffness * max(u - e{j}.gap, 0);
    case 'elasticDryFriction'
      for t = 1:numel(u)
        f(t) = max(min(e{j}.stiffness * (u(t) - w), e{j}.friction_limit_force), -e{j}.friction_limit_force);
        w = u(t) - f(t) / e{j}.stiffness;
      end
  end
  c = fft(f(N+1:end)) / N;
  F = F + [real(c(1)); 2*c(2:H+1)] * e{j}.force_direction';
end
F(2, :) = F(2, :) - s.Fex1.';
R = zeros(size(Q));
for h = 0:H
  R(h+1, :) = ((-(h*omega)^2 * s.M + 1i*h*omega * s.D + s.K) * Q(h+1, :).').' + F(h+1, :);
end
printf('%.3e\\n', max(abs(R(:))) / max(abs(s.Fex1)));
"""


@pytest.mark.skipif(shutil.which("octave-cli") is None, reason="octave is not installed (apt-get install octave)")
def test_octave_finds_our_response_in_balance_from_the_fields_of_the_file(tmp_path: Path) -> None:
    whole = system(SLIDER, STOP, CUBIC)
    save_nlvib(whole, tmp_path / "s.mat")
    scipy.io.savemat(tmp_path / "q.mat", {"Q": response(whole), "omega": OMEGA})
    (tmp_path / "residual.m").write_text(RESIDUAL)
    done = subprocess.run(
        ["octave-cli", "--norc", "--quiet", "residual.m"],
        cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    # Newton stops at 1e-9 of the motion; the stiffness of the joints turns that into force.
    assert float(done.stdout) < 1e-6


WRITE = """
system.M = sparse(diag([1 2 1.5])); system.D = zeros(3); system.K = 4e4*[2 -1 0; -1 2 -1; 0 -1 1];
system.Fex1 = [1 - 2i; 0; 3];
slider = struct('type', 'elasticDryFriction', 'stiffness', 3e4, 'friction_limit_force', 2, 'ishysteretic', true);
slider.force_direction = [0; 0; 1]; slider.islocal = 1;
cubic = struct('type', 'cubicSpring', 'stiffness', int32(7)); cubic.force_direction = sparse([1; 0; -1]);
system.nonlinear_elements = {slider, cubic};
save('-v7', 's.mat', 'system');
"""


@pytest.mark.skipif(shutil.which("octave-cli") is None, reason="octave is not installed (apt-get install octave)")
def test_what_octave_wrote_is_read(tmp_path: Path) -> None:
    (tmp_path / "write.m").write_text(WRITE)
    command = ["octave-cli", "--norc", "--quiet", "write.m"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    read = load_nlvib(tmp_path / "s.mat")
    np.testing.assert_array_equal(read.mass, M)
    np.testing.assert_array_equal(read.stiffness, K)
    np.testing.assert_array_equal(read.dynamic[1], [1.0 - 2.0j, 0.0, 3.0])
    slider, cubic = read.joints
    assert isinstance(slider, JenkinsElement)
    assert (slider.name, slider.tangential_stiffness, slider.limit_force) == ("elasticDryFriction 1", 3e4, 2.0)
    assert isinstance(cubic, CubicSpring)
    assert cubic.stiffness == 7.0
    np.testing.assert_array_equal(cubic.direction, [1.0, 0.0, -1.0])


def test_a_structure_without_joints_is_an_empty_cell(tmp_path: Path) -> None:
    save_nlvib(system(), tmp_path / "s.mat")
    assert scipy.io.loadmat(tmp_path / "s.mat")["system"][0, 0]["nonlinear_elements"].shape == (1, 0)
    assert load_nlvib(tmp_path / "s.mat").joints == ()


def test_names_without_a_field_of_their_own_and_one_element_outside_a_cell_are_read(tmp_path: Path) -> None:
    element = {"type": "cubicspring", "stiffness": 3.0, "force_direction": np.eye(N)[:, :1]}
    content = {"M": M, "D": C, "K": K, "nonlinear_elements": element}
    scipy.io.savemat(tmp_path / "s.mat", {"system": content})
    read = load_nlvib(tmp_path / "s.mat")
    assert [joint.name for joint in read.joints] == ["cubicSpring 1"]
    assert not read.dynamic.any()


RUB = FrictionContact(
    name="rub", normal=along(N, {2: 1.0}), tangents=between(N, 0), normal_stiffness=2e4, tangential_stiffness=1e4,
    friction_coefficient=0.4, preload=5.0,
)  # fmt: skip


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        (system(SLIDER, RUB), 'joint "rub" .* normal force varies.* mu N0 = 2 N'),
        (system(QuadraticDamper(name="drag", direction=between(N, 1), damping=1.0)), 'joint "drag" .*d |v| v'),
        (system(SLIDER, static_load=[0.0, 7.0, 0.0]), "static load has 7 N on degree of freedom 1"),
        (
            system(harmonic_force=np.vstack([np.zeros((3, N)), [0, 0, 4.0]])),
            "4.* N in harmonic 3 on degree of freedom 2",
        ),
    ],
)
def test_what_nlvib_lacks_is_refused_by_name(tmp_path: Path, bad: JointedSystem, message: str) -> None:
    with pytest.raises(ExchangeError, match=message):
        save_nlvib(bad, tmp_path / "s.mat")
    assert not list(tmp_path.iterdir())


def named(name: object) -> dict[str, object]:
    element = {"type": "cubicSpring", "stiffness": 3.0, "force_direction": np.eye(N)[:, :1], "name": name}
    return {"system": {"M": M, "D": C, "K": K, "nonlinear_elements": element}}


def test_an_empty_name_is_none(tmp_path: Path) -> None:
    for name in ("", np.zeros((0, 0))):
        scipy.io.savemat(tmp_path / "s.mat", named(name))
        assert [joint.name for joint in load_nlvib(tmp_path / "s.mat").joints] == ["cubicSpring 1"]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (named(np.array(["a", 1.0], dtype=object)), r"nonlinear_elements\{1\}: its name is of list, not text"),
        (named(np.ones(2)), r"nonlinear_elements\{1\}: its name is of ndarray, not text"),
        (named(7.0), "its name is of float, not text"),
        ({"x": 1.0}, 'no struct "system"'),
        ({"system": {"M": M, "D": C}}, "no field K, it has D, M"),
        ({"system": {"M": M, "D": C, "K": K, "Fex1": [1.0, 2.0]}}, "Fex1 has 2 entries, the mass 3 rows"),
        (
            {"system": {"M": M, "D": C, "K": K, "nonlinear_elements": {"type": "quadraticDamper"}}},
            r'nonlinear_elements\{1\} is of type "quadraticDamper"',
        ),
        (
            {"system": {"M": M, "D": C, "K": K, "nonlinear_elements": {"type": "cubicSpring", "stiffness": 1.0}}},
            "has no field force_direction",
        ),
    ],
)
def test_a_file_that_describes_no_structure_is_refused(
    tmp_path: Path, content: dict[str, object], message: str
) -> None:
    scipy.io.savemat(tmp_path / "s.mat", content)
    with pytest.raises(ExchangeError, match=message):
        load_nlvib(tmp_path / "s.mat")


def test_missing_and_damaged_files_and_folders_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ExchangeError, match="there is no file"):
        load_nlvib(tmp_path / "s.mat")
    (tmp_path / "s.mat").write_bytes(b"MATLAB 5.0 MAT-file" + bytes(200))
    with pytest.raises(ExchangeError, match="not a MATLAB file, or damaged"):
        load_nlvib(tmp_path / "s.mat")
    with pytest.raises(ExchangeError, match="create it first"):
        save_nlvib(system(), tmp_path / "none" / "s.mat")
