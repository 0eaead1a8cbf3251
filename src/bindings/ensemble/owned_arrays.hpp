// The arrays of a batch as the bindings own them: what Python gives, and what it gets.
#pragma once

#include <algorithm>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <nanobind/stl/vector.h>

#include "arrays.hpp"
#include "vibroimpact/ensemble/arrays.hpp"
#include "vibroimpact/observe/observers.hpp"

namespace binding {

// A batch, and the numbers that its arrays point to.
struct owned_arrays {
    // Numbers that an array is to have next.
    struct part {
        const char* name;
        const double* vi::batch_arrays::* field;
        array from;
        std::size_t size;
    };
    vi::batch_arrays view{};

    // Refuse arrays of other sizes than they are to have.
    static void check_sizes(const std::vector<part>& parts) {
        for (const auto& p : parts)
            if (p.from.size() != p.size)
                throw std::invalid_argument(std::string(p.name) + " has " +
                                            std::to_string(p.from.size()) + " numbers; expected " +
                                            std::to_string(p.size) + ".");
    }

    // Copy them all, or none.
    void add(const std::vector<part>& parts) {
        check_sizes(parts);
        for (const auto& p : parts)
            add(p.field, p.from.data(), p.size);
    }
    void add(const double* vi::batch_arrays::* field, const double* from, std::size_t size) {
        view.*field = numbers_.emplace_back(from, from + size).data();
    }

private:
    std::vector<std::vector<double>> numbers_;
};

// Reads what sweeps/observers/observer.py asks for.
class observer_reader {
public:
    observer_reader(const nb::dict& spec, owned_arrays& to) : spec_(spec), to_(to) {}

    void read() {
        auto& b = to_.view;
        b.contact = 0;
        b.stop = vi::upper_side;
        b.last = b.stride = b.longest = b.symbol_returns = b.settling_returns = 1;
        if (wanted("section", vi::sees_section)) {
            b.contact = whole("section", "contact");
            b.stop = nb::cast<int>(option("section", "side"));
            b.last = at_least_one("section", "last");
            b.stride = at_least_one("section", "stride");
        }
        if (wanted("stroboscopic", vi::sees_stroboscopic)) {
            b.strobe_last = at_least_one("stroboscopic", "last");
            b.strobe_at = number("stroboscopic", "phase");
            if (b.lines < 1) throw std::invalid_argument("stroboscopic: needs a forcing line.");
        }
        if (wanted("symbol", vi::sees_symbol)) {
            b.symbol_tolerance = number("symbol", "tolerance");
            b.symbol_returns = at_least_one("symbol", "returns");
        }
        if (wanted("settling", vi::sees_settling)) {
            b.settling_tolerance = number("settling", "tolerance");
            b.settling_returns = at_least_one("settling", "returns");
            b.longest = at_least_one("settling", "longest");
        }
        if (wanted("rotation", vi::sees_rotation)) {
            b.rotation_contact = whole("rotation", "contact");
            b.rotation_stop = nb::cast<int>(option("rotation", "side"));
            b.rotation_stride = at_least_one("rotation", "stride");
            b.rotation_tolerance = number("rotation", "tolerance");
        }
        wanted("impacts", vi::sees_impacts);
        wanted("speeds", vi::sees_speeds);
        wanted("power", vi::sees_power);
        wanted("shares", vi::sees_shares);
        if (wanted("extremes", vi::sees_extremes))
            b.extremes_count = rows("extremes", &vi::batch_arrays::extremes_rows);
        if (wanted("averages", vi::sees_averages))
            b.averages_count = rows("averages", &vi::batch_arrays::averages_rows);
        if (spec_.contains("spectrum"))
            b.exponents = 2 * b.degrees + b.lines - 1;
        else if (spec_.contains("lyapunov"))
            b.exponents = 1;
    }

private:
    nb::object option(const char* observer, const char* name) const {
        return nb::cast<nb::dict>(spec_[observer])[name];
    }
    double number(const char* observer, const char* name) const {
        return nb::cast<double>(option(observer, name));
    }
    long whole(const char* observer, const char* name) const {
        const long value = nb::cast<long>(option(observer, name));
        if (value < 0) throw std::invalid_argument(std::string(name) + ": must be >= 0.");
        return value;
    }
    long at_least_one(const char* observer, const char* name) const {
        return std::max(whole(observer, name), 1L);
    }
    bool wanted(const char* observer, unsigned bit) {
        if (spec_.contains(observer)) to_.view.wanted |= bit;
        return spec_.contains(observer);
    }

    // Rows on the coordinates; an empty one stands for a row for every coordinate.
    long long rows(const char* observer, const double* vi::batch_arrays::* field) {
        const auto n = static_cast<std::size_t>(to_.view.degrees);
        std::vector<double> out;
        for (nb::handle one : spec_[observer]) {
            auto row = nb::cast<std::vector<double>>(one);
            if (!row.empty() && row.size() != n)
                throw std::invalid_argument("row: one number per coordinate, or none.");
            for (std::size_t i = 0; row.empty() && i < n * n; ++i)
                out.push_back(i % (n + 1) == 0 ? 1.0 : 0.0);
            out.insert(out.end(), row.begin(), row.end());
        }
        if (out.size() > n * vi::most_watched)
            throw std::invalid_argument("rows: at most 16 of one observer.");
        to_.add(field, out.data(), out.size());
        return static_cast<long long>(out.size() / n);
    }

    const nb::dict& spec_;
    owned_arrays& to_;
};

// Tables that the kernel fills: one row of numbers per member.
class results {
public:
    results(const nb::dict& spec, vi::batch_arrays& b)
        : b_(b), end_(static_cast<std::size_t>(b.members)) {
        using fields = vi::batch_arrays;
        const long long n = b.degrees, points = b.last;
        const auto sees = [&](unsigned bit) { return (b.wanted & bit) != 0; };
        b.end = end_.data();
        want(true, "time", &fields::time, 1);
        want(sees(vi::sees_section), "section_position", &fields::section_position, points * n);
        want(sees(vi::sees_section), "section_velocity", &fields::section_velocity, points * n);
        want(sees(vi::sees_section), "section_phase", &fields::section_phase, points);
        want(sees(vi::sees_section), "section_time", &fields::section_time, points);
        const long long flashes = b.strobe_last;
        const bool strobe = sees(vi::sees_stroboscopic);
        want(strobe, "strobe_position", &fields::strobe_position, flashes * n);
        want(strobe, "strobe_velocity", &fields::strobe_velocity, flashes * n);
        want(strobe, "strobe_phase", &fields::strobe_phase, flashes);
        want(strobe, "strobe_time", &fields::strobe_time, flashes);
        want(sees(vi::sees_symbol), "symbol", &fields::symbol, 1 + 2 * b.contacts); // n, p, q
        want(sees(vi::sees_impacts), "impacts", &fields::impacts,
             2);                                                   // at A, at B, per period
        want(sees(vi::sees_speeds), "speeds", &fields::speeds, 4); // mean, rms, smallest, largest
        want(sees(vi::sees_power), "power", &fields::power, 1);
        want(sees(vi::sees_settling), "settling", &fields::settling, 1);
        want(sees(vi::sees_extremes), "extremes", &fields::extremes, 2 * b.extremes_count);
        want(sees(vi::sees_averages), "averages", &fields::averages, 2 * b.averages_count);
        want(sees(vi::sees_shares), "shares", &fields::shares, 1); // time at rest
        want(sees(vi::sees_shares), "counts", &fields::counts, 2); // completed chatter, grazes
        want(sees(vi::sees_rotation), "rotation", &fields::rotation, 2); // number, error
        want(spec.contains("lyapunov"), "lyapunov", &fields::lyapunov, 1);
        want(spec.contains("spectrum"), "spectrum", &fields::spectrum, b.exponents);
        want(spec.contains("final"), "final_position", &fields::final_position, n);
        want(spec.contains("final"), "final_velocity", &fields::final_velocity, n);
        want(spec.contains("final"), "final_phase", &fields::final_phase, 1);
    }

    nb::dict to_python() {
        nb::dict out;
        const std::size_t members = end_.size();
        out["end"] = to_numpy(std::move(end_), {members});
        for (auto& t : tables_)
            out[t.name] = to_numpy(std::move(t.values), {members, t.width});
        return out;
    }

private:
    struct table {
        const char* name;
        std::size_t width;
        std::vector<double> values;
    };

    void want(bool wanted, const char* name, double* vi::batch_arrays::* field, long long numbers) {
        const auto width = static_cast<std::size_t>(numbers);
        if (!wanted || width == 0) return;
        tables_.push_back({name, width, std::vector<double>(end_.size() * width)});
        b_.*field = tables_.back().values.data();
    }

    vi::batch_arrays& b_;
    std::vector<std::int8_t> end_; // member_end
    std::vector<table> tables_;
};

} // namespace binding
