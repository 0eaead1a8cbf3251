! Orbits of an impact oscillator with a given multiplier, as a boundary-value problem for AUTO-07p.
!
!   x'' + c x' + k x = A cos(theta),  theta' = w,  wall x <= d,  v+ = -e v-
!
! m flights in a row over m forcing periods, i = 1 ... m, and beside each the variation of a
! neighbouring one (xi, eta, zeta), with the time T_i of each scaled to 1, of which sigma_i is the
! variation:
!
!   x' = T v,      xi'   = T eta + sigma v
!   v' = T f,      eta'  = T (-A sin(theta) zeta - c eta - k xi) + sigma f
!   theta' = T w,  zeta' = sigma w,      f = A cos(theta) - c v - k x                 (6 m equations)
!
!   x_i(0) = d,  x_i(1) = d,  xi_i(0) = 0,  xi_i(1) = 0                             (4 m conditions)
!   v_i+1(0) = -e v_i(1),  eta_i+1(0) = -e eta_i(1)                                              (2 m)
!   theta_i+1(0) = theta_i(1),  zeta_i+1(0) = zeta_i(1)                                          (2 m)
!   eta_1(0)^2 + zeta_1(0)^2 = 1                                                                   (1)
!
! After the last flight the first one follows, with theta_1(0) + 2 pi m, mu eta_1(0), mu zeta_1(0).
! So mu is a multiplier of the orbit: 1 at a fold, -1 at a period doubling.
!
! 8 m + 1 conditions on 6 m functions: two parameters and the T_i, sigma_i are free. Along a curve
! of folds or of period doublings this problem is regular.
!
! Unknowns U, flight by flight: x, v, theta, xi, eta, zeta.
! Parameters PAR: 1 k, 2 c, 3 A, 4 w, 5 d, 6 e, 7 T_1, 8 T_2, 14 mu, 15 sigma_1, 16 sigma_2;
! measured: 9, 10 the impact speeds v_i(1); 12, 13 the phases theta_i(1) of the impacts.

subroutine func(ndim, u, icp, par, ijac, f, dfdu, dfdp)
  implicit none
  integer, intent(in) :: ndim, icp(*), ijac
  double precision, intent(in) :: u(ndim), par(*)
  double precision, intent(out) :: f(ndim)
  double precision, intent(inout) :: dfdu(ndim, ndim), dfdp(ndim, *)
  double precision :: T, sigma, force, varied
  integer :: i, j
  do i = 1, ndim/6
    j = 6*(i - 1)
    T = par(6 + i)
    sigma = par(14 + i)
    force = par(3) * cos(u(j + 3)) - par(2) * u(j + 2) - par(1) * u(j + 1)
    varied = -par(3) * sin(u(j + 3)) * u(j + 6) - par(2) * u(j + 5) - par(1) * u(j + 4)
    f(j + 1) = T * u(j + 2)
    f(j + 2) = T * force
    f(j + 3) = T * par(4)
    f(j + 4) = T * u(j + 5) + sigma * u(j + 2)
    f(j + 5) = T * varied + sigma * force
    f(j + 6) = sigma * par(4)
  end do
end subroutine func

subroutine bcnd(ndim, par, icp, nbc, u0, u1, fb, ijac, dbc)
  implicit none
  integer, intent(in) :: ndim, icp(*), nbc, ijac
  double precision, intent(in) :: par(*), u0(ndim), u1(ndim)
  double precision, intent(out) :: fb(nbc)
  double precision, intent(inout) :: dbc(nbc, *)
  double precision, parameter :: pi = 3.14159265358979323846d0
  double precision :: turns, mu
  integer :: flights, i, j, next, row
  flights = ndim/6
  do i = 1, flights
    j = 6*(i - 1)
    row = 8*(i - 1)
    next = j + 6
    turns = 0
    mu = 1
    if (i == flights) then
      next = 0
      turns = 2 * pi * flights
      mu = par(14)
    end if
    fb(row + 1) = u0(j + 1) - par(5)
    fb(row + 2) = u1(j + 1) - par(5)
    fb(row + 3) = u0(j + 4)
    fb(row + 4) = u1(j + 4)
    fb(row + 5) = u0(next + 2) + par(6) * u1(j + 2)
    fb(row + 6) = u0(next + 3) + turns - u1(j + 3)
    fb(row + 7) = mu * u0(next + 5) + par(6) * u1(j + 5)
    fb(row + 8) = mu * u0(next + 6) - u1(j + 6)
  end do
  fb(nbc) = u0(5)**2 + u0(6)**2 - 1
end subroutine bcnd

subroutine stpnt(ndim, u, par, t)  ! the start is read from a file written by curves.py
  implicit none
  integer, intent(in) :: ndim
  double precision, intent(inout) :: u(ndim), par(*)
  double precision, intent(in) :: t
end subroutine stpnt

subroutine pvls(ndim, u, par)
  implicit none
  integer, intent(in) :: ndim
  double precision, intent(in) :: u(ndim)
  double precision, intent(inout) :: par(*)
  double precision, external :: getp
  integer :: i
  do i = 1, ndim/6
    par(8 + i) = getp('BV1', 6*(i - 1) + 2, u)
    par(11 + i) = getp('BV1', 6*(i - 1) + 3, u)
  end do
end subroutine pvls

subroutine icnd
end subroutine icnd

subroutine fopt
end subroutine fopt
