"""WAV and TDMS files: channels over a common time."""

from pathlib import Path

import numpy as np
import pytest
from scipy.io import wavfile

from correlation.errors import CampaignError
from correlation.file.read_file import read_file

nptdms = pytest.importorskip("nptdms")


@pytest.mark.parametrize("kind", [np.int16, np.int32, np.float32, np.float64])
def test_samples_of_a_wav_file_come_back(tmp_path: Path, kind: type) -> None:
    samples = np.arange(-10, 10).reshape(10, 2).astype(kind)
    wavfile.write(tmp_path / "sound.wav", 8000, samples)
    measured = read_file(tmp_path / "sound.wav")
    time, first, second = measured.columns
    np.testing.assert_array_equal(time.values, np.arange(10) / 8000)
    np.testing.assert_array_equal([first.values, second.values], samples.T)
    assert (time.unit, second.name, second.abscissa, second.unit) == ("s", "channel 2", "time", "")


def test_a_cut_wav_file_is_a_sentence(tmp_path: Path) -> None:
    wavfile.write(tmp_path / "sound.wav", 8000, np.arange(30, dtype=np.int16))
    data = (tmp_path / "sound.wav").read_bytes()
    for length in range(1, len(data), 5):
        (tmp_path / "cut.wav").write_bytes(data[:length])
        with pytest.raises(CampaignError, match=r"^cut\.wav: [^\n]*$"):
            read_file(tmp_path / "cut.wav")


def test_channels_of_a_tdms_file_come_back_with_their_time_and_unit(tmp_path: Path) -> None:
    values = np.random.default_rng(1).normal(size=(2, 20))
    with nptdms.TdmsWriter(tmp_path / "run.tdms") as writer:
        sampling = {"wf_increment": 0.25, "wf_start_offset": 1.0}
        segment = [
            nptdms.RootObject({"title": "beam"}),
            nptdms.ChannelObject("run", "acc", values[0], {**sampling, "unit_string": "g"}),
            nptdms.ChannelObject("run", "force (N)", values[1], sampling),
            nptdms.ChannelObject("slow", "level", np.arange(3, dtype=np.int32), {"wf_increment": 5.0}),
            nptdms.ChannelObject("slow", "sweep", ["up", "down", "up"]),
        ]
        writer.write_segment(segment)
        writer.write_segment(segment)
    measured = read_file(tmp_path / "run.tdms")
    names = ["time", "run/acc", "run/force (N)", "time (2)", "slow/level", "slow/sweep"]
    assert [column.name for column in measured.columns] == names
    np.testing.assert_array_equal(measured.columns[0].values, 1.0 + 0.25 * np.arange(40))
    np.testing.assert_array_equal(measured.columns[1].values, [*values[0], *values[0]])
    assert [column.unit for column in measured.columns[:3]] == ["s", "g_n", "N"]
    assert measured.columns[4].abscissa == "time (2)"
    assert measured.columns[5].words == ("up", "down")
    assert measured.title == "beam"


def test_a_cut_tdms_file_is_a_sentence(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with nptdms.TdmsWriter(tmp_path / "run.tdms") as writer:
        writer.write_segment([nptdms.ChannelObject("run", "acc", np.arange(20.0), {"wf_increment": 0.25})])
    data = (tmp_path / "run.tdms").read_bytes()
    for length in range(1, len(data), 11):
        (tmp_path / "cut.tdms").write_bytes(data[:length])
        with pytest.raises(CampaignError, match=r"^cut\.tdms: [^\n]*$"):
            read_file(tmp_path / "cut.tdms")
    assert capfd.readouterr().err == ""  # the library's own warnings do not reach the screen


def test_a_wav_file_that_announces_more_than_any_memory_holds_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "a.wav"
    wavfile.write(path, 1000, np.arange(40, dtype=np.int16))
    data = bytearray(path.read_bytes())
    size = data.index(b"data") + 4
    data[size : size + 4] = (4_000_000_000).to_bytes(4, "little")
    path.write_bytes(data)
    with pytest.raises(CampaignError, match=r"a\.wav.*damaged or cut"):
        read_file(path)
