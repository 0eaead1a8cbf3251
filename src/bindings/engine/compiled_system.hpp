// A system compiled for one flow of the kernel, and its starts.
#pragma once

#include <algorithm>
#include <memory>
#include <new>
#include <utility>
#include <vector>

#include "engine/physical_map.hpp"
#include "engine/steps.hpp"
#include "engine/system.hpp"
#include "vibroimpact/engine/start.hpp"
#include "vibroimpact/system/assemble.hpp"

namespace binding {

// Makes elements in memory as it is, without writing zeros: pages of it that nothing uses cost nothing.
template <class T>
struct as_is : std::allocator<T> {
    using std::allocator<T>::allocator;
    template <class... Args>
    void construct(T* p, Args&&... args) {
        if constexpr (sizeof...(Args) == 0)
            ::new (static_cast<void*>(p)) T;
        else
            ::new (static_cast<void*>(p)) T(std::forward<Args>(args)...);
    }
    template <class U>
    struct rebind {
        using other = as_is<U>;
    };
};

template <class Flow>
class compiled_system {
    using Shape = typename Flow::shape_type;
    static constexpr int D = Flow::max_dimension;
    static constexpr int width = tangent_width<Flow>;
    using map_type = vi::coordinate_map<D>;
    template <class T>
    using trajectory = vi::trajectory<T, Shape>;

public:
    explicit compiled_system(const system_data& data)
        : data_(data), n_(data.dimension), degrees_(data.degrees),
          lines_(static_cast<int>(data.omegas.size())), physical_(n_, degrees_, data.kappas) {
        hybrid_.dimension_ = n_;
        hybrid_.contacts_ = static_cast<int>(data.contacts.size());
        hybrid_.mixed_ = data.mixed;
        if (data.sequential) hybrid_.together = vi::impact_law::sequential;
        if constexpr (Shape::max_elements > 0) {
            hybrid_.elements.given = data.given;
            hybrid_.elements.count = static_cast<int>(data.states.size());
            std::copy(data.states.begin(), data.states.end(), hybrid_.elements.states);
            std::copy(data.soft.begin(), data.soft.end(), hybrid_.elements.soft);
            std::copy(data.joint.begin(), data.joint.end(), hybrid_.elements.joint);
        }
        vi::set_lines(hybrid_, data.kappas.data(), lines_);
        for (int i = 0; i < hybrid_.contacts(); ++i) {
            const auto& from = data.contacts[i];
            vi::set_law(
                hybrid_, i,
                {from.impulse.data(), from.mobility.data(), from.shift.data(), from.restitution});
        }
    }

    const vi::hybrid<Flow>& hybrid() const { return hybrid_; }

    void add_mode(const mode_data& data) {
        physical_.add({data.to_x, data.to_v, data.offset, data.from_x, data.from_v, data.particular,
                       data.shift});
        if (modes_.empty()) modes_.reserve(expected_modes);
        compile(data, modes_.emplace_back());
        if (data.code % hybrid_.closed_sets() == 0)
            vi::set_terms(hybrid_, modes_.back(), physical_[static_cast<int>(modes_.size()) - 1]);
        codes_.push_back(data.code);
        const int m = static_cast<int>(modes_.size()) - 1;
        from_free_.push_back(vi::map_between<D>(physical_[0], physical_[m], n_));
        to_free_.push_back(vi::map_between<D>(physical_[m], physical_[0], n_));
        hybrid_.modes = modes_.data();
        hybrid_.codes = codes_.data();
        hybrid_.from_free = from_free_.data();
        hybrid_.to_free = to_free_.data();
        hybrid_.mode_count = m + 1;
    }

    int add_reset(const numbers& matrix, const numbers& shift) {
        map_type map{};
        for (int i = 0; i < n_; ++i) {
            std::copy_n(matrix.begin() + static_cast<std::ptrdiff_t>(i) * n_, n_, map.matrix[i].x);
            map.shift[i] = shift[i];
        }
        resets_.push_back(map);
        hybrid_.resets = resets_.data();
        return static_cast<int>(resets_.size()) - 1;
    }

    // A start in the free mode; seeds are columns of (dx, dv, dtheta), of which jets carry those
    // from `first` on.
    template <class T>
    trajectory<T> begin(const start_data& data, const numbers& seeds = {}, int columns = 0,
                        int first = 0) const {
        numbers plain = data.x;
        plain.insert(plain.end(), data.v.begin(), data.v.end());
        plain.insert(plain.end(), data.phases.begin(), data.phases.end());
        std::vector<T> p(plain.begin(), plain.end());
        if constexpr (vi::scalar_traits<T>::is_jet)
            for (std::size_t i = 0; i < p.size(); ++i)
                for (int j = 0; j < width && first + j < columns; ++j)
                    p[i].d[j] = seeds[i * columns + first + j];
        const T *x = p.data(), *v = x + degrees_, *phases = v + degrees_;
        trajectory<T> at{};
        vi::start_at(hybrid_, physical_[0], x, v, phases, at);
        return at;
    }

protected:
    system_data data_;
    int n_, degrees_, lines_;
    physical_maps physical_;
    vi::hybrid<Flow> hybrid_{};
    std::vector<vi::mode<double, Flow>, as_is<vi::mode<double, Flow>>> modes_;

private:
    static constexpr std::size_t expected_modes = 64;

    // In place: a mode has room for the largest system of its shape, up to 1 MB.
    void compile(const mode_data& data, vi::mode<double, Flow>& m) const {
        vi::begin_mode(m);
        static_cast<vi::sizes<Shape>&>(m.flow) = hybrid_;
        vi::set_flow(m.flow, {data.step, data.k.data(), data.c.data(), data.a.data(), data.b.data(),
                              data.constant.data(), data.norm.empty() ? nullptr : data.norm.data(),
                              &data.growth});
        for (int i = 0; i < hybrid_.contacts(); ++i) {
            const auto& from = data.guards[i];
            vi::set_guard(m.guards[i],
                          {from.row.data(), from.gain, from.lower, from.upper, from.side}, m.flow);
        }
        for (const auto& w : data.watches)
            vi::add_watch(m, {{w.guard.row.data(), w.guard.gain, w.guard.lower, w.guard.upper, 0},
                              w.element,
                              w.held,
                              w.reset,
                              w.target});
        vi::prepare_search(m, data.code == 0);
    }

    std::vector<map_type> from_free_, to_free_, resets_;
    std::vector<int> codes_;
};

} // namespace binding
