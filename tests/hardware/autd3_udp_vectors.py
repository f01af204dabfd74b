"""Bytes of the vendor's SDK for commands with seeded data, one per line: version of the protocol, name, and the bytes of
each datagram to the second of two units, from the command's number on. tests/data/autd3_udp_commands.txt holds them:

    for sdk in build/autd3_sdk/0.11 build/autd3_sdk/0.12; do /usr/bin/python3 tests/hardware/autd3_udp_vectors.py $sdk; done
"""

import asyncio
import sys

import numpy
from autd3_units import Emulator, Wire

UNITS = 2
PER_UNIT = 249


def seeded(seed, count):
    """The bytes that tests/hardware/autd3_udp_protocol_test.cpp makes too."""
    made = bytearray()
    for _ in range(count):
        seed = (1664525 * seed + 1013904223) % 2**32
        made.append(seed >> 24)
    return bytes(made)


async def write(sdk):
    sys.path.insert(0, sdk)
    import autd3
    import autd3_modulation
    from autd3 import commands, value

    geometry = autd3.geometry.Geometry([autd3.geometry.Autd3(origin=[0, 0, 0]) for _ in range(UNITS)])

    def pattern(seed):
        data = numpy.frombuffer(seeded(seed, 2 * UNITS * PER_UNIT), dtype=numpy.uint8).reshape(2, UNITS, PER_UNIT)
        phases, intensities = geometry.phase_buffer(), geometry.intensity_buffer()
        for unit in range(UNITS):
            for n in range(PER_UNIT):
                phases[unit][n] = int(data[0, unit, n])
                intensities[unit][n] = int(data[1, unit, n])
        return phases, intensities

    def modulation(seed, count):
        buffer = autd3_modulation.ModulationBuffer(count)
        for k, sample in enumerate(seeded(seed, count)):
            buffer[k] = sample
        return commands.Modulation(value.SamplingConfig.FREQ_4K, buffer)

    stored = [pattern(seed) for seed in (10, 11, 12)]
    made = {
        "smoothing": commands.SetSilencer(),
        "pattern": commands.Pattern(*pattern(1)),
        "modulation_20": modulation(2, 20),
        "modulation_1500": modulation(3, 1500),
        "stored_3": commands.PatternStm(value.SamplingConfig(40), [one[0] for one in stored], [one[1] for one in stored], commands.PatternStmOption(bank=value.PatternBank.B1)),
        "clear": commands.Clear(),
        "synchronize": commands.Synchronize(),
    }
    with Emulator(sdk, UNITS) as emulator, Wire(emulator) as wire:
        option = autd3.UdpOption(iface=autd3.Interface.Addr(f"[::1]:{wire.port}"))
        client = await autd3.Client.open(geometry, option, autd3.ClientConfig())
        for name, command in made.items():
            wire.datagrams.clear()
            await client.send(command)
            version = wire.datagrams[-1][3][0]
            print(version, name, *(data.hex() for _, data in wire.commands(UNITS - 1)))
        await client.close()


if __name__ == "__main__":
    asyncio.run(write(sys.argv[1]))
