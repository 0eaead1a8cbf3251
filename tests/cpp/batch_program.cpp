// A batch of impact dampers as a program: the table of observers, or the rows of its members.
//
// It stands for the extension module where a test compiles another list of observers. Input and output are
// words: a name, how many numbers follow, and the numbers, hexadecimal. Options of an observer are
// numbers of the name observer.option, a stop being +1 or -1.
#include <cstdio>
#include <iostream>
#include <map>
#include <string>
#include <vector>

#include "ensemble/batch_of.hpp"
#include "vibroimpact/flow/modal.hpp"

namespace {

using numbers = std::vector<double>;
using fields = vi::batch_arrays;

const std::map<std::string, const double* fields::*> of_systems{
    {"omegas", &fields::omegas},
    {"kappas", &fields::kappas},
    {"steps", &fields::steps},
    {"impulse", &fields::impulse},
    {"mobility", &fields::mobility},
    {"shift", &fields::shift},
    {"restitution", &fields::restitution},
    {"damping", &fields::damping},
    {"k", &fields::k},
    {"c", &fields::c},
    {"a", &fields::a},
    {"rows", &fields::rows},
    {"gains", &fields::gains},
    {"lower", &fields::lower},
    {"upper", &fields::upper},
    {"to_x", &fields::to_x},
    {"to_v", &fields::to_v},
    {"offset", &fields::offset},
    {"from_x", &fields::from_x},
    {"from_v", &fields::from_v},
    {"particular", &fields::particular},
};
const std::map<std::string, const double* fields::*> of_members{
    {"position", &fields::position}, {"velocity", &fields::velocity}, {"phases", &fields::phases},
    {"settle", &fields::settle},     {"observe", &fields::observe},
};

std::map<std::string, numbers> read() {
    std::map<std::string, numbers> out;
    std::string name, word;
    for (std::size_t count; std::cin >> name >> count;)
        for (auto& values = out[name]; count > 0 && std::cin >> word; --count)
            values.push_back(std::strtod(word.c_str(), nullptr));
    return out;
}

void print(const std::string& name, const double* from, std::size_t count) {
    std::printf("%s %zu", name.c_str(), count);
    for (std::size_t i = 0; i < count; ++i)
        std::printf(" %a", from[i]);
    std::printf("\n");
}

struct option_printer {
    std::string observer;
    void say(const char* name, const char* kind, long long low = 0, long long high = 0) const {
        std::printf("option %s %s %s %lld %lld\n", observer.c_str(), name, kind, low, high);
    }
    void count(const char* name, long, long long low, long long high) const {
        say(name, "count", low, high);
    }
    void share(const char* name, double) const { say(name, "share"); }
    void real(const char* name, double) const { say(name, "real"); }
    void stop(const char* name, int) const { say(name, "stop"); }
    void rows(const char* name, const vi::row_list&, int most) const { say(name, "rows", most); }
    void of_rows(const char* name, const double*, const vi::row_list&, double low,
                 double high) const {
        std::printf("option %s %s of_rows %a %a\n", observer.c_str(), name, low, high);
    }
    void velocities(const vi::row_list&) const {}
};

struct option_reader {
    const std::map<std::string, numbers>& from;
    std::string observer;
    const numbers& of(const char* name) const { return from.at(observer + "." + name); }
    void count(const char* name, long& value, long long, long long) const {
        value = static_cast<long>(of(name).at(0));
    }
    void share(const char* name, double& value) const { value = of(name).at(0); }
    void real(const char* name, double& value) const { value = of(name).at(0); }
    void stop(const char* name, int& value) const { value = static_cast<int>(of(name).at(0)); }
    void rows(const char* name, vi::row_list& rows, int) const { // of two coordinates
        rows = {of(name).data(), static_cast<long long>(of(name).size() / 6)};
    }
    void of_rows(const char* name, const double*& numbers, const vi::row_list&, double,
                 double) const {
        numbers = of(name).data();
    }
    void velocities(vi::row_list& rows) const {
        static constexpr double each[] = {0, 0, 1, 0, 0, 0, 0, 0, 0, 1, 0, 0};
        rows = {each, 2};
    }
};

void print_table() {
    vi::observer_declarations{}.each([&](auto& one) {
        std::printf("observer %s\n", one.name);
        if constexpr (requires { one.options(option_printer{one.name}); })
            one.options(option_printer{one.name});
        one.tables(vi::batch_sizes{}, [&](const char* name, auto&&...) {
            std::printf("table %s %s\n", one.name, name);
        });
    });
}

void run() {
    const auto given = read();
    binding::system_numbers systems;
    vi::batch_arrays b{};
    b.systems = 1;
    b.degrees = 2;
    b.lines = b.contacts = 1;
    b.modes = static_cast<long long>(given.at("codes").size());
    b.members = static_cast<long long>(given.at("settle").size());
    b.most_impacts = static_cast<long long>(given.at("most_impacts").at(0));
    for (const auto& [name, field] : of_systems)
        systems.add(field, given.at(name).data(), given.at(name).size(), {});
    for (const auto& [name, field] : of_members)
        b.*field = given.at(name).data();
    const auto whole = [&](const char* name) {
        return std::vector<int>(given.at(name).begin(), given.at(name).end());
    };
    const auto codes = whole("codes"), side = whole("side");
    const std::vector<int> system(static_cast<std::size_t>(b.members));
    b.codes = codes.data();
    b.side = side.data();
    b.system = system.data();
    std::vector<signed char> end(system.size());
    numbers time(system.size());
    b.end = end.data();
    b.time = time.data();

    std::map<std::string, numbers> results;
    b.observers.each([&]<class One>(One& one) {
        if (!given.contains(one.name)) return;
        b.observers.wanted |= b.observers.template bit<One>;
        const option_reader options{given, one.name};
        if constexpr (requires { one.options(options); }) one.options(options);
        one.tables(b, [&](const char* name, vi::result_table& table, long long width,
                          double fill = vi::not_a_number()) {
            auto& rows = results[std::string(one.name) + "." + name];
            rows.assign(system.size() * static_cast<std::size_t>(width), fill);
            table = {rows.data(), width};
        });
    });
    binding::run_alone<vi::modal_flow<double, vi::fixed<6, 1, 1>>>({systems, b, system.data()},
                                                                   [] { return false; });
    const numbers ends(end.begin(), end.end());
    print("end", ends.data(), ends.size());
    print("time", time.data(), time.size());
    for (const auto& [name, rows] : results)
        print(name, rows.data(), rows.size());
}

} // namespace

int main(int count, char**) {
    count > 1 ? print_table() : run();
}
