// A compiled system and its starts, read from the text that tests/support/system_file.py writes.
#pragma once

#include <cstdlib>
#include <fstream>
#include <string>
#include <vector>

#include "engine/compiled_system.hpp"

namespace test {

class reader {
public:
    explicit reader(const std::string& path) : in_(path) {}

    double number() {
        std::string word;
        in_ >> word;
        return std::strtod(word.c_str(), nullptr); // hexadecimal floats, inf
    }
    int integer() { return static_cast<int>(number()); }
    binding::numbers numbers() {
        binding::numbers out(static_cast<std::size_t>(integer()));
        for (double& x : out)
            x = number();
        return out;
    }

private:
    std::ifstream in_;
};

inline binding::system_data read_system(reader& in) {
    binding::system_data data{};
    data.dimension = in.integer();
    data.degrees = in.integer();
    data.mixed = in.integer() != 0;
    data.omegas = in.numbers();
    data.kappas = in.numbers();
    data.step = in.number();
    data.contacts.resize(static_cast<std::size_t>(in.integer()));
    for (auto& c : data.contacts) {
        c.impulse = in.numbers();
        c.mobility = in.numbers();
        c.shift = in.numbers();
        c.restitution[0] = in.number();
        c.restitution[1] = in.number();
    }
    return data;
}

inline binding::mode_data read_mode(reader& in, std::size_t contacts) {
    binding::mode_data m{};
    m.code = in.integer();
    for (auto* part : {&m.k, &m.c, &m.a, &m.b, &m.constant})
        *part = in.numbers();
    m.guards.resize(contacts);
    for (auto& g : m.guards) {
        g.row = in.numbers();
        g.gain = in.number();
        g.lower = in.number();
        g.upper = in.number();
        g.side = in.integer();
    }
    for (auto* part : {&m.to_x, &m.to_v, &m.offset, &m.from_x, &m.from_v, &m.particular})
        *part = in.numbers();
    return m;
}

template <class Flow>
binding::compiled_system<Flow> read_compiled(reader& in) {
    const auto data = read_system(in);
    binding::compiled_system<Flow> system(data);
    for (int modes = in.integer(); modes > 0; --modes) {
        auto mode = read_mode(in, data.contacts.size());
        mode.step = data.step;
        system.add_mode(mode);
    }
    return system;
}

inline std::vector<binding::start_data> read_starts(reader& in) {
    std::vector<binding::start_data> starts(static_cast<std::size_t>(in.integer()));
    for (auto& s : starts) {
        s.x = in.numbers();
        s.v = in.numbers();
        s.phases = in.numbers();
    }
    return starts;
}

} // namespace test
