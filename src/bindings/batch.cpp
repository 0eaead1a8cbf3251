#include "batch.hpp"

#include <algorithm>
#include <limits>

#include "vibroimpact/ensemble.hpp"

namespace binding {

namespace {

// Entry s of an array with a leading axis of systems.
numbers slice(const numbers& all, std::size_t s, std::size_t count) {
    const std::size_t size = all.size() / count;
    const auto from = all.begin() + static_cast<std::ptrdiff_t>(s * size);
    return {from, from + static_cast<std::ptrdiff_t>(size)};
}

// Row i of such an entry.
numbers slice(const numbers& all, std::size_t s, std::size_t count, std::size_t i,
              std::size_t rows) {
    return slice(all, s * rows + i, count * rows);
}

} // namespace

system_data system_at(const batch_data& batch, std::size_t s) {
    const std::size_t count = batch.count, contacts = batch.contacts;
    system_data out{static_cast<int>(batch.dimension),
                    static_cast<int>(batch.degrees),
                    slice(batch.omegas, s, count),
                    slice(batch.kappas, s, count),
                    batch.steps[s],
                    {}};
    for (std::size_t i = 0; i < contacts; ++i) {
        const double* r = batch.restitution.data() + 2 * (s * contacts + i);
        out.contacts.push_back({slice(batch.impulse, s, count, i, contacts),
                                slice(batch.mobility, s, count, i, contacts),
                                slice(batch.shift, s, count, i, contacts),
                                {r[0], r[1]}});
    }
    return out;
}

mode_data mode_at(const batch_data& batch, const batch_mode& mode, std::size_t s) {
    const std::size_t count = batch.count, contacts = batch.contacts;
    const auto part = [&](const numbers& all) { return slice(all, s, count); };
    mode_data out{mode.code,
                  part(mode.k),
                  part(mode.c),
                  part(mode.a),
                  part(mode.b),
                  part(mode.constant),
                  {},
                  part(mode.to_x),
                  part(mode.to_v),
                  part(mode.offset),
                  part(mode.from_x),
                  part(mode.from_v),
                  part(mode.particular)};
    for (std::size_t i = 0; i < contacts; ++i) {
        const std::size_t at = s * contacts + i;
        out.guards.push_back({slice(mode.rows, s, count, i, contacts), mode.gains[at],
                              mode.lower[at], mode.upper[at], mode.side[i]});
    }
    return out;
}

observed::observed(const batch_data& batch, const observer_options& options, std::size_t members)
    : end(members, static_cast<std::int8_t>(vi::member_end::interrupted)) {
    const auto n = batch.degrees, points = static_cast<std::size_t>(options.last);
    const auto want = [&](unsigned bit, table& t, std::size_t width) {
        if (options.wanted & bit) t.width = width;
    };
    time.width = 1;
    want(vi::sees_section, section_position, points * n);
    want(vi::sees_section, section_velocity, points * n);
    want(vi::sees_section, section_phase, points);
    want(vi::sees_section, section_time, points);
    want(vi::sees_symbol, symbol, 3);
    want(vi::sees_impacts, impacts, 2);
    want(vi::sees_speeds, speeds, 4);
    want(vi::sees_power, power, 1);
    want(vi::sees_settling, settling, 1);
    want(vi::sees_extremes, extremes, 2 * (options.extremes.size() / n));
    want(vi::sees_averages, averages, 2 * (options.averages.size() / n));
    want(vi::sees_shares, shares, 1);
    want(vi::sees_shares, counts, 2);
    if (options.lyapunov) lyapunov.width = 1;
    if (options.spectrum) spectrum.width = 2 * n + batch.lines - 1;
    if (options.final_state) {
        final_position.width = final_velocity.width = n;
        final_phase.width = 1;
    }
    each([&](table& t) {
        const bool whole = &t == &symbol || &t == &counts; // become integers
        t.values.assign(members * t.width, whole ? 0.0 : std::numeric_limits<double>::quiet_NaN());
    });
}

} // namespace binding
