// Between Python and the observers of a batch: the table that says which exist, their options, their results.
#pragma once

#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include "ensemble/owned_arrays.hpp"
#include "vibroimpact/ensemble/ensemble.hpp"

namespace binding {

// Options by name, as the table has them: their kind, and the range of whole numbers.
class option_table {
public:
    explicit option_table(nb::dict& to) : to_(to) {}
    void count(const char* name, long, long long least, long long most) const {
        to_[name] = nb::make_tuple("count", least, most);
    }
    void share(const char* name, double) const { to_[name] = nb::make_tuple("share"); }
    void real(const char* name, double) const { to_[name] = nb::make_tuple("real"); }
    void stop(const char* name, int) const { to_[name] = nb::make_tuple("stop"); }
    void rows(const char* name, const vi::row_list&, int most) const {
        to_[name] = nb::make_tuple("rows", most);
    }
    void of_rows(const char* name, const double*, const vi::row_list&, double least,
                 double most) const {
        to_[name] = nb::make_tuple("of_rows", least, most);
    }
    void velocities(const vi::row_list&) const {}

private:
    nb::dict& to_;
};

// By name of an observer: its options, and the names of its tables of results.
inline nb::dict observer_table() {
    nb::dict out;
    vi::observer_declarations{}.each([&](auto& one) {
        nb::dict options;
        nb::list tables;
        if constexpr (requires { one.options(option_table(options)); })
            one.options(option_table(options));
        one.tables(vi::batch_sizes{}, [&](const char* name, auto&&...) { tables.append(name); });
        out[one.name] = nb::make_tuple(options, nb::tuple(tables));
    });
    return out;
}

// Reads the options of one observer.
class option_reader {
public:
    option_reader(const nb::dict& from, owned_arrays& to) : from_(from), to_(to) {}

    void count(const char* name, long& value, long long least, long long most) const {
        value = nb::cast<long>(from_[name]);
        if (value < least || value > most) refuse(name, "out of range");
    }
    void share(const char* name, double& value) const {
        real(name, value);
        if (!(value > 0.0 && value < 1.0)) refuse(name, "must be in (0, 1)");
    }
    void real(const char* name, double& value) const {
        value = nb::cast<double>(from_[name]);
        if (!std::isfinite(value)) refuse(name, "must be finite");
    }
    void stop(const char* name, int& value) const {
        const auto stop = nb::cast<std::string>(from_[name]);
        if (stop != "A" && stop != "B") refuse(name, "must be A or B");
        value = stop == "A" ? vi::upper_side : vi::lower_side;
    }
    // An empty row stands for a row for every coordinate; what a row does not give is zero.
    void rows(const char* name, vi::row_list& rows, int most) const {
        const std::size_t n = degrees(), width = 3 * n;
        std::vector<double> out;
        for (nb::handle one : from_[name]) {
            const auto row = nb::cast<std::vector<double>>(one);
            if (row.size() % n != 0 || row.size() > width)
                refuse(name, "numbers for (x), (x, v) or (x, v, a), or none");
            if (row.empty()) add_units(0, out);
            out.insert(out.end(), row.begin(), row.end());
            out.resize((out.size() + width - 1) / width * width);
        }
        if (out.size() > width * static_cast<std::size_t>(most)) refuse(name, "too many");
        keep(out, rows);
    }
    // One for each row; of a row for every coordinate, as often.
    void of_rows(const char* name, const double*& numbers, const vi::row_list& rows, double least,
                 double most) const {
        std::vector<double> out;
        std::size_t i = 0;
        for (nb::handle one : from_["rows"]) {
            const double x = nb::cast<double>(from_[name][nb::int_(i++)]);
            if (!(x >= least && x <= most)) refuse(name, "out of range");
            out.insert(out.end(), nb::len(one) ? 1 : degrees(), x);
        }
        if (out.size() != static_cast<std::size_t>(rows.count)) refuse(name, "one for each row");
        numbers = to_.keep(out.data(), out.size());
    }
    void velocities(vi::row_list& rows) const {
        std::vector<double> out;
        add_units(degrees(), out);
        keep(out, rows);
    }

private:
    std::size_t degrees() const { return static_cast<std::size_t>(to_.view.degrees); }
    // A row with a one for each coordinate, behind so many numbers.
    void add_units(std::size_t behind, std::vector<double>& out) const {
        for (std::size_t i = 0; i < degrees(); ++i) {
            out.resize(out.size() + 3 * degrees());
            out[out.size() - 3 * degrees() + behind + i] = 1.0;
        }
    }
    void keep(const std::vector<double>& out, vi::row_list& rows) const {
        rows = {to_.keep(out.data(), out.size()),
                static_cast<long long>(out.size() / (3 * degrees()))};
    }
    [[noreturn]] static void refuse(const char* name, const char* why) {
        throw std::invalid_argument(std::string(name) + ": " + why + ".");
    }

    const nb::dict& from_;
    owned_arrays& to_;
};

// Take in the observers that are wanted: options by name of the observer.
inline void read_observers(const nb::dict& wanted, owned_arrays& to) {
    auto& all = to.view.observers;
    std::size_t found = 0;
    all.each([&]<class One>(One& one) {
        if (!wanted.contains(one.name)) return;
        ++found;
        all.wanted |= all.template bit<One>;
        const auto options = nb::cast<nb::dict>(wanted[one.name]);
        if constexpr (requires { one.options(option_reader(options, to)); })
            one.options(option_reader(options, to));
    });
    if (found != wanted.size()) throw std::invalid_argument("observers: an unknown one.");
}

// Tables that the kernel fills: one row of numbers per member, which holds what stands for none before.
class results {
public:
    explicit results(vi::batch_arrays& b)
        : end_(static_cast<std::size_t>(b.members),
               static_cast<std::int8_t>(vi::member_end::interrupted)),
          time_(end_.size()) {
        b.end = end_.data();
        b.time = time_.data();
        b.observers.each_wanted([&](auto& one) {
            one.tables(b, [&](const char* name, vi::result_table& table, long long width,
                              double fill = vi::not_a_number()) {
                const auto columns = static_cast<std::size_t>(width);
                tables_.push_back({std::string(one.name) + "." + name, columns,
                                   std::vector<double>(end_.size() * columns, fill)});
                table = {tables_.back().numbers.data(), width};
            });
        });
    }

    // By name: the tables as observer.table.
    nb::dict to_python() {
        nb::dict out;
        const std::size_t members = end_.size();
        out["end"] = to_numpy(std::move(end_), {members});
        out["time"] = to_numpy(std::move(time_), {members});
        for (auto& t : tables_)
            out[t.name.c_str()] = to_numpy(std::move(t.numbers), {members, t.columns});
        return out;
    }

private:
    struct named_table {
        std::string name;
        std::size_t columns;
        std::vector<double> numbers;
    };
    std::vector<std::int8_t> end_;
    std::vector<double> time_;
    std::vector<named_table> tables_;
};

} // namespace binding
