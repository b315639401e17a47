!> What a test uses; stand-in for the part of pFUnit's module of this name that the tests need.
module funit
   use funit_asserts
   use funit_exceptions, only: SourceLocation, throw, catch, anyExceptions
   implicit none
   public
end module funit
